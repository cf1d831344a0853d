#include <cmath>

#include "cases/image_case.hpp"

namespace vivant::cases {
namespace {

std::int64_t reflect(std::int64_t i, std::int64_t n) {
  if (i < 0) return -i;
  return i < n ? i : 2 * (n - 1) - i;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const double sigma = v.attributes.at("sigma");
  const std::int64_t radius = static_cast<std::int64_t>(std::ceil(3 * sigma));
  double total = 0;
  std::vector<double> taps;
  for (std::int64_t d = -radius; d <= radius; ++d) {
    taps.push_back(std::exp(-0.5 * static_cast<double>(d * d) / (sigma * sigma)));
    total += taps.back();
  }
  return {make_image(in[0].shape, [&](std::int64_t y, std::int64_t x, std::int64_t c) {
    double sum = 0;
    for (std::int64_t i = -radius; i <= radius; ++i)
      for (std::int64_t j = -radius; j <= radius; ++j)
        sum += taps[i + radius] * taps[j + radius] *
               pixel(in[0], reflect(y + i, v.sizes[0]), reflect(x + j, v.sizes[1]), c);
    return sum / (total * total);
  })};
}

const Register registration(OpCase{
    .op = "gaussian_blur",
    .variations = {{{7, 9, 1}, {{"sigma", 2.0}}},
                   {{20, 41, 1}, {{"sigma", 1.0}}},
                   {{13, 11, 3}, {{"sigma", 1.0}}},
                   {{5, 4, 17}, {{"sigma", 0.7}}}},
    .inputs = one_image,
    .reference = reference,
    .benchmark = {{540, 960, 1}, {{"sigma", 2.0}}},
    .flops =
        [](const Variation& v) {
          return 6.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]) *
                 (1 + std::ceil(3 * v.attributes.at("sigma").get<double>()));
        },
    .bytes =
        [](const Variation& v) { return 16.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]); },
});

}  // namespace
}  // namespace vivant::cases
