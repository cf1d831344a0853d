#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: planes, height, width, channels

std::vector<HostTensor> inputs(const Variation& v, Random& random) { return {random.tensor(Shape(v.sizes))}; }

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t height = v.sizes[1], width = v.sizes[2], channels = v.sizes[3];
  const auto at = [&](std::int64_t plane, std::int64_t y, std::int64_t x, std::int64_t c) {
    return in[0].data[((plane * height + y) * width + x) * channels + c];
  };
  double sum = 0;
  for (std::int64_t plane = 0; plane < v.sizes[0]; ++plane)
    for (std::int64_t y = 0; y < height; ++y)
      for (std::int64_t x = 0; x < width; ++x)
        for (std::int64_t c = 0; c < channels; ++c) {
          const double here = at(plane, y, x, c);
          const double right = x + 1 < width ? at(plane, y, x + 1, c) - here : 0,
                       below = y + 1 < height ? at(plane, y + 1, x, c) - here : 0;
          sum += right * right + below * below;
        }
  HostTensor mean;
  mean.shape = {1};
  mean.data = {sum / static_cast<double>(in[0].data.size())};
  return {mean};
}

double elements(const Variation& v) {
  return static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2] * v.sizes[3]);
}

const Register registration(OpCase{
    .op = "plane_variation",
    .variations = {{{1, 1, 1, 1}}, {{3, 5, 7, 3}}, {{2, 1, 40, 5}}, {{3, 17, 13, 16}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{3, 256, 256, 16}},
    .flops = [](const Variation& v) { return 6.0 * elements(v); },
    .bytes = [](const Variation& v) { return 4.0 * elements(v); },
});

}  // namespace
}  // namespace vivant::cases
