#include <algorithm>
#include <cmath>

#include "cases/image_case.hpp"

namespace vivant::cases {
namespace {

struct Sample {
  std::int64_t low, high;
  double weight;  // of high
};

Sample sample(std::int64_t o, std::int64_t in, std::int64_t out) {
  const double ratio = static_cast<double>(in) / static_cast<double>(out);
  const double s = std::max(0.0, (static_cast<double>(o) + 0.5) * ratio - 0.5);
  const std::int64_t low = std::min(in - 1, static_cast<std::int64_t>(std::floor(s + 1e-12)));
  const std::int64_t high = std::min(in - 1, low + 1);
  return {low, high, s - static_cast<double>(low)};
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const HostTensor& image = in[0];
  const std::int64_t height = v.attributes.at("height"), width = v.attributes.at("width");
  return {make_image({height, width, v.sizes[2]}, [&](std::int64_t y, std::int64_t x, std::int64_t c) {
    const Sample row = sample(y, v.sizes[0], height), column = sample(x, v.sizes[1], width);
    const auto at = [&](std::int64_t r) {
      return (1 - column.weight) * pixel(image, r, column.low, c) +
             column.weight * pixel(image, r, column.high, c);
    };
    return (1 - row.weight) * at(row.low) + row.weight * at(row.high);
  })};
}

Variation to(std::int64_t height, std::int64_t width, std::vector<std::int64_t> sizes) {
  return {std::move(sizes), {{"height", height}, {"width", width}}};
}

const Register registration(OpCase{
    .op = "resize_bilinear",
    .variations = {to(10, 14, {5, 7, 19}), to(20, 4, {5, 1, 3}), to(3, 5, {11, 7, 16}),
                   to(11, 17, {9, 20, 2}), to(1, 1, {4, 6, 1})},
    .inputs = one_image,
    .reference = reference,
    .benchmark = to(192, 192, {48, 48, 256}),
    .flops =
        [](const Variation& v) {
          return 8.0 * static_cast<double>(v.sizes[2]) * v.attributes.at("height").get<double>() *
                 v.attributes.at("width").get<double>();
        },
    .bytes =
        [](const Variation& v) {
          return 4.0 * static_cast<double>(v.sizes[2]) *
                 (static_cast<double>(v.sizes[0] * v.sizes[1]) +
                  v.attributes.at("height").get<double>() * v.attributes.at("width").get<double>());
        },
});

}  // namespace
}  // namespace vivant::cases
