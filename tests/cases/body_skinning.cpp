#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: vertices, joints, influences
std::vector<HostTensor> skinning_inputs(const Variation& v, Random& random) {
  const std::int64_t vertices = v.sizes[0], joints = v.sizes[1], influences = v.sizes[2];
  std::vector<HostTensor> in = {random.tensor({vertices, 3}), random.tensor({joints, 12}),
                                random.tensor({vertices, influences}),
                                random.tensor({vertices, influences}, 0, 1)};
  in[2].dtype = DType::i32;
  for (double& joint : in[2].data) joint = static_cast<double>(random.integer(joints));
  in[3].differentiable = false;
  return in;
}

std::vector<HostTensor> skinning_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t vertices = v.sizes[0], influences = v.sizes[2];
  HostTensor posed, blended;
  posed.shape = {vertices, 3};
  blended.shape = {vertices, 12};
  for (std::int64_t i = 0; i < vertices; ++i) {
    std::vector<double> t(12, 0.0);
    for (std::int64_t k = 0; k < influences; ++k) {
      const std::int64_t at = i * influences + k, joint = static_cast<std::int64_t>(in[2].data[at]);
      for (int e = 0; e < 12; ++e) t[e] += in[3].data[at] * in[1].data[joint * 12 + e];
    }
    const double* x = in[0].data.data() + 3 * i;
    for (int r = 0; r < 3; ++r)
      posed.data.push_back(t[4 * r] * x[0] + t[4 * r + 1] * x[1] + t[4 * r + 2] * x[2] + t[4 * r + 3]);
    blended.data.insert(blended.data.end(), t.begin(), t.end());
  }
  return {posed, blended};
}

const Register skinning(OpCase{
    .op = "body_skinning",
    .variations = {{{1, 1, 1}}, {{65, 3, 2}}, {{331, 31, 4}}},
    .inputs = skinning_inputs,
    .reference = skinning_reference,
    .benchmark = {{13380, 31, 4}},
    .flops = [](const Variation& v) { return static_cast<double>(v.sizes[0] * (24 * v.sizes[2] + 18)); },
    .bytes = [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * (18 + 2 * v.sizes[2])); },
});

std::vector<HostTensor> compose_reference(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor y;
  y.shape = {v.sizes[0], 12};
  for (std::int64_t i = 0; i < v.sizes[0]; ++i)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) {
        double sum = c == 3 ? in[0].data[12 * i + 4 * r + 3] : 0;
        for (int k = 0; k < 3; ++k) sum += in[0].data[12 * i + 4 * r + k] * in[1].data[12 * i + 4 * k + c];
        y.data.push_back(sum);
      }
  return {y};
}

// sizes: rows
const Register compose(OpCase{
    .op = "compose_transforms",
    .variations = {{{1}}, {{67}}},
    .inputs = [](const Variation& v, Random& random) -> std::vector<HostTensor> {
      return {random.tensor({v.sizes[0], 12}), random.tensor({v.sizes[0], 12})};
    },
    .reference = compose_reference,
    .benchmark = {{13380}},
    .flops = [](const Variation& v) { return 63.0 * static_cast<double>(v.sizes[0]); },
    .bytes = [](const Variation& v) { return 4.0 * 36 * static_cast<double>(v.sizes[0]); },
});

}  // namespace
}  // namespace vivant::cases
