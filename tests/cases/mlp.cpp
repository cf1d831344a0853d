#include <algorithm>
#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, live rows (-1: all), 1 with biases or 2 with biases so large that no ReLU is near its kink,
// then the widths of x and of each layer's output
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const auto& s = v.sizes;
  std::vector<HostTensor> in = {random.tensor({s[0], s[3]})};
  in[0].live_rows = s[1];
  for (std::size_t layer = 4; layer < s.size(); ++layer) {
    in.push_back(random.tensor({s[layer - 1], s[layer]}));
    in.push_back(random.tensor({s[layer]}));
    in.back().absent = s[2] == 0;
    if (s[2] == 2)
      for (double& b : in.back().data) b = std::copysign(2 * std::sqrt(static_cast<double>(s[layer - 1])), b);
  }
  while (in.size() < 7) {
    in.emplace_back();
    in.back().absent = true;
  }
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const auto& s = v.sizes;
  const std::int64_t rows = s[1] < 0 ? s[0] : s[1];
  const bool output_relu = v.attributes.value("output", "none") == "relu";
  HostTensor y;
  y.shape = {s[0], s.back()};
  for (std::int64_t r = 0; r < rows; ++r) {
    std::vector<double> x(in[0].data.begin() + r * s[3], in[0].data.begin() + (r + 1) * s[3]);
    for (std::size_t layer = 4; layer < s.size(); ++layer) {
      const HostTensor &w = in[2 * layer - 7], &b = in[2 * layer - 6];
      std::vector<double> next;
      for (std::int64_t j = 0; j < s[layer]; ++j) {
        double sum = b.absent ? 0 : b.data[j];
        for (std::int64_t k = 0; k < s[layer - 1]; ++k) sum += x[k] * w.data[k * s[layer] + j];
        next.push_back(layer + 1 < s.size() || output_relu ? std::max(0.0, sum) : sum);
      }
      x = next;
    }
    y.data.insert(y.data.end(), x.begin(), x.end());
  }
  return {y};
}

double flops(const Variation& v) {
  double products = 0;
  for (std::size_t layer = 4; layer < v.sizes.size(); ++layer)
    products += static_cast<double>(v.sizes[layer - 1] * v.sizes[layer]);
  return 2 * static_cast<double>(v.sizes[0]) * products;
}

// A small step keeps central differences away from the ReLUs' kinks.
const Register register_mlp(OpCase{
    .op = "mlp",
    .variations = {{{1, -1, 1, 1, 1}},
                   {{25, -1, 1, 3, 17, 5}},
                   {{97, 61, 1, 16, 33, 48, 3}, {{"output", "relu"}}},
                   {{49, -1, 0, 39, 64, 32, 16}},
                   {{211, 0, 1, 5, 16, 4}},
                   {{230, 197, 1, 13, 80, 7}},
                   {{131, 97, 2, 39, 64, 48}}},
    .inputs = inputs,
    .reference = reference,
    .for_matrix_units = {{{700, 650, 2, 33, 70, 20}}},
    .gradient_tolerance = 1e-5,
    .step = 1e-7,
    .has_kinks = [](const Variation& v) { return v.sizes[2] != 2; },
    .benchmark = {{196608, -1, 1, 48, 128, 128, 32}},
    .flops = flops,
    .bytes =
        [](const Variation& v) {
          return 4.0 * static_cast<double>(v.sizes[0] * (v.sizes[3] + v.sizes.back()));
        },
});

}  // namespace
}  // namespace vivant::cases
