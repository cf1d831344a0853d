#include <algorithm>

#include "cases/op_case.hpp"
#include "vivant/ops/philox.hpp"

namespace vivant::cases {
namespace {

// sizes: rays, coarse samples
constexpr std::uint32_t seed = 17, step = 900;

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t rays = v.sizes[0], coarse = v.sizes[1];
  std::vector<HostTensor> in = {random.tensor({rays, coarse}, 1, 8), random.tensor({rays, coarse}, 0, 0.1),
                                random.tensor({rays, 1}, 0.1, 0.9), random.tensor({rays, 1}, 8.5, 9)};
  for (std::int64_t r = 0; r < rays; ++r) {
    std::sort(in[0].data.begin() + r * coarse, in[0].data.begin() + (r + 1) * coarse);
    double* weight = in[1].data.data() + r * coarse;
    if (r % 3 == 1) std::fill_n(weight, coarse, 0.0);  // nothing there: evenly over the bins
    if (r % 3 == 2) weight[coarse / 2] = 5;            // a surface
  }
  for (const std::uint32_t number : {seed, step}) {
    HostTensor scalar;
    scalar.dtype = DType::i32;
    scalar.shape = {1};
    scalar.data = {static_cast<double>(number)};
    in.push_back(scalar);
  }
  for (int i = 0; i < 4; ++i) in[i].differentiable = false;
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t rays = v.sizes[0], bins = v.sizes[1], number = v.attributes["samples"];
  HostTensor depths, deltas;
  depths.shape = deltas.shape = {rays, number};
  for (std::int64_t r = 0; r < rays; ++r) {
    const double* w = in[1].data.data() + r * bins;
    std::vector<double> edges(in[0].data.begin() + r * bins, in[0].data.begin() + (r + 1) * bins), sums = {0};
    edges[0] = in[2].data[r];
    edges.push_back(in[3].data[r]);
    for (std::int64_t i = 0; i < bins; ++i) {
      const double before = w[std::max<std::int64_t>(i - 1, 0)], behind = w[std::min(i + 1, bins - 1)];
      sums.push_back(sums.back() + (std::max(before, w[i]) + std::max(behind, w[i])) / 2 +
                     0.3 / static_cast<double>(bins));
    }
    for (std::int64_t k = 0; k < number; ++k) {
      const auto index = static_cast<std::uint32_t>(r * ((number + 3) / 4) * 4 + k);
      const double place =
          v.attributes.value("jitter", true)
              ? unit_interval(random_word(seed, step, v.attributes.value("stream", 0u), index))
              : 0.5;
      const double wanted = sums.back() * (static_cast<double>(k) + place) / static_cast<double>(number);
      const std::int64_t bin = std::lower_bound(sums.begin() + 1, sums.end() - 1, wanted) - sums.begin() - 1;
      depths.data.push_back(edges[bin] + (edges[bin + 1] - edges[bin]) * (wanted - sums[bin]) /
                                             (sums[bin + 1] - sums[bin]));
    }
    for (std::int64_t i = r * number; i < (r + 1) * number; ++i)
      deltas.data.push_back((i + 1 == (r + 1) * number ? in[3].data[r] : depths.data[i + 1]) -
                            depths.data[i]);
  }
  return {depths, deltas};
}

const Register registration(OpCase{
    .op = "importance_samples",
    .variations = {{{1, 1}, {{"samples", 1}}},
                   {{17, 13}, {{"samples", 9}, {"stream", 3}}},
                   {{6, 5}, {{"samples", 32}, {"jitter", false}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16384, 64}, {{"samples", 64}}},
    .bytes = [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0]) * (2 * 64 + 2 * 64); },
});

}  // namespace
}  // namespace vivant::cases
