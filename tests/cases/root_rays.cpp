#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rays, live rays (-1: all)
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], 3}), random.tensor({v.sizes[0], 3}),
                                random.tensor({2, 12})};
  in[0].live_rows = v.sizes[1];
  for (HostTensor& tensor : in) tensor.differentiable = false;
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor rays;
  rays.shape = {v.sizes[0], 6};
  const double* t = in[2].data.data();
  const double root[3] = {v.attributes.value("x", 0.0), v.attributes.value("y", 0.0),
                          v.attributes.value("z", 0.0)};
  for (std::int64_t i = 0; i < (v.sizes[1] < 0 ? v.sizes[0] : v.sizes[1]); ++i)
    for (int part = 0; part < 2; ++part)
      for (int c = 0; c < 3; ++c) {
        double sum = part == 0 ? -root[c] : 0;
        for (int r = 0; r < 3; ++r)
          sum += t[4 * r + c] * (in[part].data[3 * i + r] - (part == 0 ? t[4 * r + 3] : 0));
        rays.data.push_back(sum);
      }
  return {rays};
}

const Register registration(OpCase{
    .op = "root_rays",
    .variations = {{{1, -1}}, {{67, 51}, {{"x", 0.5}, {"y", -1.0}, {"z", 2.0}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{65536, -1}},
    .bytes = [](const Variation& v) { return 4.0 * 12 * static_cast<double>(v.sizes[0]); },
});

}  // namespace
}  // namespace vivant::cases
