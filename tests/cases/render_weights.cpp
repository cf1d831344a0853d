#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rays, samples, channels (0: weights alone), 1 for an opaque last sample

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const auto& s = v.sizes;
  const bool extreme = s[3] == 1;
  std::vector<HostTensor> in = {random.tensor({s[0], s[1]}, 0.1, 8), random.tensor({s[0], s[1]}, 0.01, 0.3),
                                random.tensor({s[0], s[1]}, 0.1, 4)};
  for (std::int64_t i = 0; extreme && i < s[0] * s[1]; ++i) {
    if (i % 7 == 3 && i % s[1] != s[1] - 1) in[0].data[i] = 0;  // nothing there
    if (i % 11 == 5) in[1].data[i] = 0;                         // no interval
    if (i % s[1] == s[1] - 1) in[1].data[i] = 1e10;
  }
  if (extreme) in[0].data[0] = 1e4;  // a wall at the first sample of the first ray
  in[1].differentiable = in[2].differentiable = false;
  if (s[2] > 0) in.push_back(random.tensor({s[0] * s[1], s[2]}));
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t rays = v.sizes[0], samples = v.sizes[1], channels = v.sizes[2];
  HostTensor weight, alpha, depth, sum;
  weight.shape = {rays, samples};
  alpha.shape = depth.shape = {rays, 1};
  for (std::int64_t r = 0; r < rays; ++r) {
    double transmittance = 1, mean = 0, total = 0;
    std::vector<double> colour(channels, 0.0);
    for (std::int64_t i = r * samples; i < (r + 1) * samples; ++i) {
      const double passes = std::exp(-in[0].data[i] * in[1].data[i]), w = transmittance * (1 - passes);
      transmittance *= passes;
      weight.data.push_back(w);
      total += w;
      mean += w * in[2].data[i];
      for (std::int64_t c = 0; c < channels; ++c) colour[c] += w * in[3].data[i * channels + c];
    }
    alpha.data.push_back(total);
    depth.data.push_back(mean);
    sum.data.insert(sum.data.end(), colour.begin(), colour.end());
  }
  if (channels == 0) return {weight, alpha, depth};
  sum.shape = {rays, channels};
  return {sum, alpha, depth, weight};
}

const Register register_weights(OpCase{
    .op = "render_weights",
    .variations = {{{1, 1, 0, 0}}, {{5, 40, 0, 0}}, {{66, 33, 0, 1}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16384, 128, 0, 0}},
    .flops = [](const Variation& v) { return 6.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 16.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

const Register register_volume_render(OpCase{
    .op = "volume_render",
    .variations = {{{7, 17, 32, 0}}, {{9, 40, 32, 1}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16384, 128, 32, 0}},
    .flops =
        [](const Variation& v) {
          return static_cast<double>(v.sizes[0] * v.sizes[1]) * (6.0 + 2.0 * static_cast<double>(v.sizes[2]));
        },
    .bytes =
        [](const Variation& v) {
          return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * (4 + v.sizes[2]));
        },
});

}  // namespace
}  // namespace vivant::cases
