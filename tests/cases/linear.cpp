#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, K, N, live rows (-1: all), rows of the bias
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const auto& s = v.sizes;
  std::vector<HostTensor> in = {random.tensor({s[0], s[1]}), random.tensor({s[1], s[2]}),
                                random.tensor({s[4], s[2]})};
  in[0].live_rows = s[3];
  if (s[4] == s[0]) in[2].live_rows = s[3];
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t k_extent = v.sizes[1], n = v.sizes[2];
  const std::int64_t rows = v.sizes[3] < 0 ? v.sizes[0] : v.sizes[3];
  const bool softplus = v.attributes.value("activation", "none") == "softplus";
  HostTensor y;
  y.shape = {v.sizes[0], n};
  for (std::int64_t r = 0; r < rows; ++r)
    for (std::int64_t j = 0; j < n; ++j) {
      double sum = in[2].data[r / (v.sizes[0] / v.sizes[4]) * n + j];
      for (std::int64_t k = 0; k < k_extent; ++k) sum += in[0].data[r * k_extent + k] * in[1].data[k * n + j];
      y.data.push_back(softplus ? std::log1p(std::exp(sum)) : sum);
    }
  return {y};
}

const Register registration(OpCase{
    .op = "linear",
    .variations = {{{1, 1, 1, -1, 1}},
                   {{7, 13, 17, -1, 1}},
                   {{96, 13, 17, -1, 6}},
                   {{97, 39, 64, -1, 1}, {{"activation", "softplus"}}},
                   {{150, 20, 48, 101, 1}, {{"activation", "softplus"}}},
                   {{700, 5, 3, 0, 1}},
                   {{67, 5, 19, 41, 67}},
                   {{29, 65, 67, 23, 1}},  // the weight gradient packs its operands
                   {{1, 64, 64, -1, 1}},
                   {{9, 65, 67, -1, 1}},
                   {{130, 700, 20, 127, 1}}},  // two blocks of rows
    .inputs = inputs,
    .reference = reference,
    .for_matrix_units = {{{2100, 40, 70, 2050, 1}}},
    .benchmark = {{196608, 128, 128, -1, 1}},
    .flops =
        [](const Variation& v) { return 2.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]); },
    .bytes =
        [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * (v.sizes[1] + v.sizes[2])); },
});

}  // namespace
}  // namespace vivant::cases
