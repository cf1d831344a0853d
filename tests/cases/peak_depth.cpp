#include <algorithm>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rays, samples

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const Shape shape{v.sizes[0], v.sizes[1]};
  std::vector<HostTensor> in = {random.tensor(shape, 0, 0.1), random.tensor(shape, 0.1, 4)};
  const std::int64_t samples = v.sizes[1];
  for (std::int64_t r = 0; r < v.sizes[0]; ++r)
    std::sort(in[1].data.begin() + r * samples, in[1].data.begin() + (r + 1) * samples);
  for (std::int64_t r = 0; r < v.sizes[0]; ++r) {
    const auto row = in[0].data.begin() + r * samples;
    if (r % 5 == 1) std::fill_n(row, samples, 0.0);  // nothing there
    if (r % 5 == 2) row[0] = 0.5;                    // the first sample
    if (r % 5 == 3) row[samples - 1] = 0.5;          // the last one
    if (r % 5 == 4) row[samples / 2] = row[std::max<std::int64_t>(0, samples / 2 - 5)] = 0.3;  // equal ones
  }
  for (HostTensor& tensor : in) tensor.differentiable = false;
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor depth;
  depth.shape = {v.sizes[0], 1};
  for (std::int64_t r = 0; r < v.sizes[0]; ++r) {
    const std::int64_t first = r * v.sizes[1], end = first + v.sizes[1];
    std::int64_t peak = first;
    double greatest = 0;
    for (std::int64_t i = first; i < end; ++i) {
      const std::int64_t from = std::max(first, std::min(i, end - 2)), to = std::min(from + 1, end - 1);
      const std::vector<double>& depths = in[1].data;
      const double length = v.sizes[1] == 1 ? 1 : std::max((depths[to] - depths[from]) / depths[to], 1e-6);
      if (in[0].data[i] / length <= greatest) continue;
      greatest = in[0].data[i] / length;
      peak = i;
    }
    double sum = 0, moment = 0;
    for (std::int64_t i = std::max(first, peak - 1); i < std::min(end, peak + 2); ++i) {
      sum += in[0].data[i];
      moment += in[0].data[i] * in[1].data[i];
    }
    depth.data.push_back(sum > 0 ? moment / sum : 0);
  }
  return {depth};
}

const Register registration(OpCase{
    .op = "peak_depth",
    .variations = {{{1, 1}}, {{5, 40}}, {{66, 33}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16384, 128}},
    .flops = [](const Variation& v) { return static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
