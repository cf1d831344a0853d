#include <algorithm>
#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rays, samples

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t rays = v.sizes[0], samples = v.sizes[1];
  std::vector<HostTensor> in = {random.tensor({rays, samples}, 0, 2.0 / static_cast<double>(samples)),
                                random.tensor({rays, samples}, 1, 8), random.tensor({rays, 1}, 0.2, 0.9),
                                random.tensor({rays, 1}, 8.5, 12)};
  for (std::int64_t r = 0; r < rays; ++r)
    std::sort(in[1].data.begin() + r * samples, in[1].data.begin() + (r + 1) * samples);
  for (int i = 1; i < 4; ++i) in[i].differentiable = false;
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t samples = v.sizes[1];
  const bool disparity = v.attributes.value("spacing", "linear") == "disparity";
  HostTensor y;
  y.shape = {v.sizes[0], 1};
  for (std::int64_t r = 0; r < v.sizes[0]; ++r) {
    const double near = in[2].data[r], far = in[3].data[r];
    const auto own = [&](double depth) {
      return disparity ? (1 / near - 1 / depth) / (1 / near - 1 / far) : (depth - near) / (far - near);
    };
    const double* w = in[0].data.data() + r * samples;
    std::vector<double> edges;
    for (std::int64_t i = 0; i < samples; ++i) edges.push_back(own(in[1].data[r * samples + i]));
    edges.push_back(1);
    double sum = 0;
    for (std::int64_t i = 0; i < samples; ++i) {
      for (std::int64_t j = 0; j < samples; ++j)
        sum += w[i] * w[j] * std::abs(edges[i] + edges[i + 1] - edges[j] - edges[j + 1]) / 2;
      sum += w[i] * w[i] * (edges[i + 1] - edges[i]) / 3;
    }
    y.data.push_back(sum);
  }
  return {y};
}

const Register registration(OpCase{
    .op = "ray_distortion",
    .variations = {{{1, 1}}, {{5, 40}}, {{66, 33}, {{"spacing", "disparity"}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16384, 128}},
    .flops = [](const Variation& v) { return 14.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 8.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
