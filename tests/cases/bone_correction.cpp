#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: points, live points, frames, joints, vertices, influences
std::vector<HostTensor> bone_inputs(const Variation& v, Random& random) {
  const std::int64_t points = v.sizes[0], frames = v.sizes[2], joints = v.sizes[3], vertices = v.sizes[4],
                     influences = v.sizes[5], faces = 2 * vertices;
  const auto integers = [&](Shape shape, std::int64_t end, std::int64_t low = 0) {
    HostTensor x = random.tensor(shape);
    x.dtype = DType::i32;
    for (double& value : x.data) value = static_cast<double>(low + random.integer(end - low));
    return x;
  };
  std::vector<HostTensor> in = {random.tensor({points, 3}),
                                integers({points, 1}, faces, -1),
                                random.tensor({points, 3}, 0, 1),
                                integers({points, 1}, frames),
                                random.tensor({frames, joints, 6}),
                                integers({faces, 3}, vertices),
                                integers({vertices, influences}, joints),
                                random.tensor({vertices, influences}, 0, 1),
                                random.tensor({joints, 3})};
  for (int i : {2, 7, 8}) in[i].differentiable = false;
  for (int i = 0; i < 4; ++i) in[i].live_rows = v.sizes[1];
  return in;
}

std::vector<HostTensor> bone_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t joints = v.sizes[3], influences = v.sizes[5];
  HostTensor e;
  e.shape = {v.sizes[0], 3};
  e.data.assign(3 * v.sizes[1], 0.0);
  for (std::int64_t n = 0; n < v.sizes[1]; ++n) {
    const auto face = static_cast<std::int64_t>(in[1].data[n]),
               frame = static_cast<std::int64_t>(in[3].data[n]);
    for (int corner = 0; face >= 0 && corner < 3; ++corner)
      for (std::int64_t k = 0; k < influences; ++k) {
        const std::int64_t at = static_cast<std::int64_t>(in[5].data[3 * face + corner]) * influences + k;
        const auto joint = static_cast<std::int64_t>(in[6].data[at]);
        const double weight = in[2].data[3 * n + corner] * in[7].data[at];
        const double* code = in[4].data.data() + (frame * joints + joint) * 6;
        double from[3];
        for (int c = 0; c < 3; ++c) from[c] = in[0].data[3 * n + c] - in[8].data[3 * joint + c];
        for (int c = 0; c < 3; ++c)
          e.data[3 * n + c] += weight * (code[(c + 1) % 3] * from[(c + 2) % 3] -
                                         code[(c + 2) % 3] * from[(c + 1) % 3] + code[3 + c]);
      }
  }
  return {e};
}

const Register bone(OpCase{
    .op = "bone_correction",
    .variations = {{{1, 1, 1, 1, 1, 1}}, {{67, 41, 3, 5, 11, 4}}, {{2111, 2100, 2, 3, 7, 2}}},
    .inputs = bone_inputs,
    .reference = bone_reference,
    .benchmark = {{65536, 65536, 70, 31, 13380, 4}},
    .flops = [](const Variation& v) { return static_cast<double>(v.sizes[0] * v.sizes[5]) * 3 * 24; },
    .bytes = [](const Variation& v) { return 4.0 * 11 * static_cast<double>(v.sizes[0]); },
});

}  // namespace
}  // namespace vivant::cases
