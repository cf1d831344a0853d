#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: frames, height, width, channels, rays, live rays (-1: all)

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const auto& s = v.sizes;
  HostTensor images, pixels;
  images.dtype = DType::u8;
  images.shape = {s[0], s[1], s[2], s[3]};
  for (std::int64_t i = 0; i < images.shape.elements(); ++i)
    images.data.push_back(static_cast<double>(random.integer(256)));
  pixels.dtype = DType::i32;
  pixels.shape = {s[4], 1};
  pixels.live_rows = s[5];
  for (std::int64_t i = 0; i < s[4]; ++i)
    pixels.data.push_back(i % 10 == 9 ? -1 : static_cast<double>(random.integer(s[0] * s[1] * s[2])));
  return {images, pixels};
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t channels = v.sizes[3];
  HostTensor y;
  y.shape = {v.sizes[4], channels};
  for (std::int64_t r = 0; r < (v.sizes[5] < 0 ? v.sizes[4] : v.sizes[5]); ++r)
    for (std::int64_t c = 0; c < channels; ++c) {
      const auto pixel = static_cast<std::int64_t>(in[1].data[r]);
      y.data.push_back(pixel < 0 ? 0 : in[0].data[pixel * channels + c] / 255);
    }
  return {y};
}

const Register registration(OpCase{
    .op = "image_gather",
    .variations = {{{1, 1, 1, 3, 1, -1}}, {{3, 5, 7, 3, 97, 80}}, {{2, 4, 3, 1, 20, -1}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16, 360, 640, 3, 65536, -1}},
    .bytes = [](const Variation& v) { return 5.0 * static_cast<double>(v.sizes[3] * v.sizes[4]); },
});

}  // namespace
}  // namespace vivant::cases
