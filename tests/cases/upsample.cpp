#include <algorithm>
#include <cmath>

#include "cases/image_case.hpp"

namespace vivant::cases {
namespace {

double input_elements(const Variation& v) {
  return static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]);
}

// sizes: H, W, C
std::vector<HostTensor> upsample_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const bool bilinear = v.attributes.at("mode") == "bilinear";
  const auto at = [&](std::int64_t y, std::int64_t x, std::int64_t c) {
    return pixel(in[0], std::clamp<std::int64_t>(y, 0, v.sizes[0] - 1),
                 std::clamp<std::int64_t>(x, 0, v.sizes[1] - 1), c);
  };
  return {make_image({2 * v.sizes[0], 2 * v.sizes[1], v.sizes[2]},
                     [&](std::int64_t y, std::int64_t x, std::int64_t c) {
                       if (!bilinear) return at(y / 2, x / 2, c);
                       // Three quarters of the nearest pixel, a quarter of its neighbour on the other side.
                       const std::int64_t dy = y % 2 == 0 ? -1 : 1, dx = x % 2 == 0 ? -1 : 1;
                       return (9 * at(y / 2, x / 2, c) + 3 * at(y / 2 + dy, x / 2, c) +
                               3 * at(y / 2, x / 2 + dx, c) + at(y / 2 + dy, x / 2 + dx, c)) /
                              16;
                     })};
}

const Register register_upsample(OpCase{
    .op = "upsample2x",
    .variations = {{{1, 1, 1}, {{"mode", "nearest"}}},
                   {{3, 5, 16}, {{"mode", "nearest"}}},
                   {{3, 2, 5}, {{"mode", "bilinear"}}}},
    .inputs = one_image,
    .reference = upsample_reference,
    .benchmark = {{128, 128, 64}, {{"mode", "nearest"}}},
    .bytes = [](const Variation& v) { return 20 * input_elements(v); },
});

// sizes: H, W, 4C
std::vector<HostTensor> depth_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t channels = v.sizes[2] / 4;
  return {make_image({2 * v.sizes[0], 2 * v.sizes[1], channels},
                     [&](std::int64_t y, std::int64_t x, std::int64_t c) {
                       return pixel(in[0], y / 2, x / 2, (y % 2 * 2 + x % 2) * channels + c);
                     })};
}

const Register register_depth_to_space(OpCase{
    .op = "depth_to_space",
    .variations = {{{1, 1, 4}}, {{3, 5, 12}}, {{2, 3, 64}}},
    .inputs = one_image,
    .reference = depth_reference,
    .benchmark = {{128, 128, 256}},
    .bytes = [](const Variation& v) { return 8 * input_elements(v); },
});

// sizes: H, W, CI, CO; the bias is absent when CO is even
std::vector<HostTensor> transposed_inputs(const Variation& v, Random& random) {
  const auto& s = v.sizes;
  std::vector<HostTensor> in = {random.tensor({s[0], s[1], s[2]}), random.tensor({2, 2, s[2], s[3]}),
                                random.tensor({s[3]})};
  in[2].absent = s[3] % 2 == 0;
  return in;
}

std::vector<HostTensor> transposed_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t inner = v.sizes[2], columns = v.sizes[3];
  return {make_image({2 * v.sizes[0], 2 * v.sizes[1], columns},
                     [&](std::int64_t y, std::int64_t x, std::int64_t o) {
                       double sum = in[2].absent ? 0 : in[2].data[o];
                       const std::int64_t tap = y % 2 * 2 + x % 2;
                       for (std::int64_t c = 0; c < inner; ++c)
                         sum += pixel(in[0], y / 2, x / 2, c) * in[1].data[(tap * inner + c) * columns + o];
                       return sum;
                     })};
}

const Register register_transposed(OpCase{
    .op = "transposed_conv2d",
    .variations = {{{3, 5, 5, 3}}, {{2, 3, 5, 16}}},
    .inputs = transposed_inputs,
    .reference = transposed_reference,
    .benchmark = {{64, 64, 128, 64}},
    .flops = [](const Variation& v) { return 8 * input_elements(v) * static_cast<double>(v.sizes[3]); },
    .bytes =
        [](const Variation& v) {
          return 4 * input_elements(v) *
                 (1 + 4 * static_cast<double>(v.sizes[3]) / static_cast<double>(v.sizes[2]));
        },
});

}  // namespace
}  // namespace vivant::cases
