#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: H, W, CI, CO, side of the window; the bias is absent when CO is even
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const auto& s = v.sizes;
  std::vector<HostTensor> in = {random.tensor({s[0], s[1], s[2]}), random.tensor({s[4], s[4], s[2], s[3]}),
                                random.tensor({s[3]})};
  in[2].absent = s[3] % 2 == 0;
  return in;
}

std::int64_t mirrored(std::int64_t i, std::int64_t extent) {
  return i < 0 ? -i : i >= extent ? 2 * (extent - 1) - i : i;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t height = v.sizes[0], width = v.sizes[1], inner = v.sizes[2], n = v.sizes[3],
                     side = v.sizes[4];
  const std::string padding = v.attributes.value("padding", "zero");
  const bool softplus = v.attributes.value("activation", "none") == "softplus";
  const std::int64_t pad = padding == "none" ? 0 : side / 2, shrink = side - 1 - 2 * pad;
  HostTensor y;
  y.shape = {height - shrink, width - shrink, n};
  for (std::int64_t i = 0; i < height - shrink; ++i)
    for (std::int64_t j = 0; j < width - shrink; ++j)
      for (std::int64_t o = 0; o < n; ++o) {
        double sum = in[2].absent ? 0 : in[2].data[o];
        for (std::int64_t tap = 0; tap < side * side; ++tap) {
          std::int64_t row = i + tap / side - pad, column = j + tap % side - pad;
          if (padding == "reflect") {
            row = mirrored(row, height);
            column = mirrored(column, width);
          }
          if (row < 0 || row >= height || column < 0 || column >= width) continue;
          for (std::int64_t c = 0; c < inner; ++c)
            sum += in[0].data[(row * width + column) * inner + c] * in[1].data[(tap * inner + c) * n + o];
        }
        y.data.push_back(softplus ? std::log1p(std::exp(sum)) : sum);
      }
  return {y};
}

const Register registration(OpCase{
    .op = "conv2d",
    .variations = {{{1, 1, 3, 17, 3}},
                   {{7, 9, 3, 17, 3}, {{"padding", "reflect"}, {"activation", "softplus"}}},
                   {{2, 3, 3, 17, 3}, {{"padding", "reflect"}}},
                   {{5, 8, 3, 17, 3}, {{"padding", "none"}}},
                   {{6, 5, 20, 3, 3}, {{"padding", "reflect"}}},
                   {{3, 5, 17, 70, 3}},
                   {{4, 5, 3, 17, 1}},
                   {{16, 13, 16, 17, 3}},  // Winograd's algorithm from here on
                   {{15, 14, 32, 16, 3}, {{"padding", "reflect"}, {"activation", "softplus"}}},
                   {{18, 17, 16, 33, 3}, {{"padding", "none"}}},
                   {{13, 16, 16, 80, 3}, {{"padding", "reflect"}}},
                   {{19, 20, 16, 16, 3}, {{"padding", "none"}}},  // tiles reach two pixels beyond
                   {{2, 64, 16, 16, 3}, {{"padding", "reflect"}}},
                   {{25, 26, 16, 48, 3}},
                   {{28, 25, 32, 16, 3}, {{"padding", "reflect"}}}},
    .inputs = inputs,
    .reference = reference,
    .for_matrix_units = {{{9, 270, 20, 33, 3}}, {{5, 45, 64, 70, 3}, {{"padding", "reflect"}}}},
    .benchmark = {{128, 128, 64, 64, 3}},
    .flops =
        [](const Variation& v) {
          return 2.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2] * v.sizes[3] * v.sizes[4] *
                                           v.sizes[4]);
        },
    .bytes =
        [](const Variation& v) {
          return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * (v.sizes[2] + v.sizes[3]));
        },
});

}  // namespace
}  // namespace vivant::cases
