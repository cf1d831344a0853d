#include <cmath>
#include <numbers>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, dimensions, frequencies, live rows (-1: all)
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], v.sizes[1]})};
  in[0].live_rows = v.sizes[3];
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t dimensions = v.sizes[1],
                     frequencies = v.attributes.at("frequencies").get<std::int64_t>();
  const std::int64_t rows = v.sizes[3] < 0 ? v.sizes[0] : v.sizes[3];
  HostTensor y;
  y.shape = {v.sizes[0], dimensions * (1 + 2 * frequencies)};
  for (std::int64_t r = 0; r < rows; ++r) {
    const double* x = in[0].data.data() + r * dimensions;
    y.data.insert(y.data.end(), x, x + dimensions);
    for (std::int64_t l = 0; l < frequencies; ++l) {
      const double octave = std::pow(2.0, static_cast<double>(l)) * std::numbers::pi;
      for (std::int64_t d = 0; d < dimensions; ++d) y.data.push_back(std::sin(octave * x[d]));
      for (std::int64_t d = 0; d < dimensions; ++d) y.data.push_back(std::cos(octave * x[d]));
    }
  }
  return {y};
}

const Register registration(OpCase{
    .op = "positional_encoding",
    .variations = {{{1, 1, 0, -1}, {{"frequencies", 0}}},
                   {{7, 3, 0, -1}, {{"frequencies", 4}}},
                   {{131, 3, 0, 65}, {{"frequencies", 6}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{65536, 3, 0, -1}, {{"frequencies", 6}}},
    .flops = [](const Variation& v) { return 13.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 4.0 * 14 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
