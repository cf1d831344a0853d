#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, channels, live rows (-1: all), mean of the data; given statistics
std::vector<HostTensor> statistics_inputs(const Variation& v, Random& random) {
  const double mean = static_cast<double>(v.sizes[3]);
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], v.sizes[1]}, mean - 1, mean + 2)};
  in[0].live_rows = v.sizes[2];
  return in;
}

std::int64_t rows_of(const Variation& v) { return v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2]; }

std::vector<HostTensor> statistics(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t channels = v.sizes[1], rows = rows_of(v);
  HostTensor mean{.shape = {channels}, .data = std::vector<double>(channels)}, deviation = mean;
  for (std::int64_t c = 0; c < channels; ++c) {
    double sum = 0, squares = 0;
    for (std::int64_t r = 0; r < rows; ++r) sum += in[0].data[r * channels + c];
    mean.data[c] = sum / static_cast<double>(rows);
    for (std::int64_t r = 0; r < rows; ++r)
      squares += std::pow(in[0].data[r * channels + c] - mean.data[c], 2);
    deviation.data[c] = std::sqrt(squares / static_cast<double>(rows - 1) + 1e-5);
  }
  return {mean, deviation};
}

const Register register_statistics(OpCase{
    .op = "channel_statistics",
    .variations = {{{2, 1, -1, 0}}, {{70, 19, -1, 0}}, {{1100, 16, 600, 100}}, {{600, 3, 515, 0}}},
    .inputs = statistics_inputs,
    .reference = statistics,
    .benchmark = {{36864, 256, -1, 0}},
    .flops = [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

std::vector<HostTensor> norm_inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in = statistics_inputs(v, random);
  in.push_back(random.tensor({v.sizes[1]}));
  in.push_back(random.tensor({v.sizes[1]}, 0.5, 2));
  for (int i : {1, 2}) {
    in[i].absent = v.sizes[4] == 0;
    in[i].differentiable = false;
  }
  return in;
}

std::vector<HostTensor> norm_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::vector<HostTensor> own = statistics(v, in);
  const HostTensor &mean = v.sizes[4] ? in[1] : own[0], &deviation = v.sizes[4] ? in[2] : own[1];
  HostTensor y;
  y.shape = in[0].shape;
  for (std::int64_t i = 0; i < rows_of(v) * v.sizes[1]; ++i)
    y.data.push_back((in[0].data[i] - mean.data[i % v.sizes[1]]) / deviation.data[i % v.sizes[1]]);
  return {y};
}

const Register register_norm(OpCase{
    .op = "mean_variance_norm",
    .variations = {{{70, 19, -1, 0, 0}}, {{1100, 16, 600, 10, 0}}, {{130, 33, 71, 0, 1}}, {{3, 2, -1, 0, 0}}},
    .inputs = norm_inputs,
    .reference = norm_reference,
    .benchmark = {{36864, 256, -1, 0, 0}},
    .flops = [](const Variation& v) { return 6.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 12.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
