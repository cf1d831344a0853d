#include <algorithm>
#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: depth, height, width, points, live points (-1: all). Some points lie outside.
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], v.sizes[1], v.sizes[2]}),
                                random.tensor({v.sizes[3], 3}, -1.5, 2.5)};
  in[1].live_rows = v.sizes[4];
  for (HostTensor& tensor : in) tensor.differentiable = false;
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const double low = v.attributes.value("low", -1.0), high = v.attributes.value("high", 1.0);
  HostTensor y;
  y.shape = {v.sizes[3], 1};
  for (std::int64_t i = 0; i < (v.sizes[4] < 0 ? v.sizes[3] : v.sizes[4]); ++i) {
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      std::int64_t at = 0;
      for (int axis = 2; axis >= 0; --axis) {  // z, y, x
        const std::int64_t nodes = v.sizes[2 - axis];
        const double place =
            std::clamp((in[1].data[3 * i + axis] - low) / (high - low) * (nodes - 1.0), 0.0, nodes - 1.0);
        const auto node = static_cast<std::int64_t>(place);
        const bool upper = corner >> axis & 1;
        weight *= upper ? place - node : 1 - (place - node);
        at = at * nodes + std::min(node + upper, nodes - 1);
      }
      sum += weight * in[0].data[at];
    }
    y.data.push_back(sum);
  }
  return {y};
}

const Register registration(OpCase{
    .op = "sample_grid",
    .variations = {{{1, 1, 1, 1, -1}}, {{5, 7, 4, 67, -1}, {{"high", 2.0}}}, {{2, 3, 9, 131, 99}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{64, 64, 64, 65536, -1}},
    .bytes = [](const Variation& v) { return 4.0 * 12 * static_cast<double>(v.sizes[3]); },
});

}  // namespace
}  // namespace vivant::cases
