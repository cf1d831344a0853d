#include <algorithm>

#include "cases/image_case.hpp"

namespace vivant::cases {
namespace {

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const auto& a = v.attributes;
  const std::int64_t top = a.at("y"), left = a.at("x");
  return {make_image({a.at("height"), a.at("width"), v.sizes[2]},
                     [&](std::int64_t y, std::int64_t x, std::int64_t c) {
                       return pixel(in[0], std::clamp<std::int64_t>(top + y, 0, v.sizes[0] - 1),
                                    std::clamp<std::int64_t>(left + x, 0, v.sizes[1] - 1), c);
                     })};
}

Variation window(int y, int x, int height, int width, std::vector<std::int64_t> sizes,
                 bool replicate = false) {
  return {std::move(sizes),
          {{"y", y}, {"x", x}, {"height", height}, {"width", width}, {"replicate", replicate}}};
}

const Register registration(OpCase{
    .op = "crop",
    .variations = {window(1, 2, 4, 5, {7, 9, 3}), window(-2, -3, 13, 14, {8, 9, 17}, true),
                   window(5, -4, 6, 6, {8, 3, 5}, true), window(-5, 1, 3, 1, {4, 2, 1}, true)},
    .inputs = one_image,
    .reference = reference,
    .benchmark = window(-8, -8, 208, 208, {192, 192, 64}, true),
    .bytes =
        [](const Variation& v) {
          return 8.0 * static_cast<double>(v.sizes[2]) * v.attributes.at("height").get<double>() *
                 v.attributes.at("width").get<double>();
        },
});

}  // namespace
}  // namespace vivant::cases
