#pragma once
#include "cases/op_case.hpp"

namespace vivant::cases {

/// sizes: height, width, channels
inline std::vector<HostTensor> one_image(const Variation& v, Random& random) {
  return {random.tensor({v.sizes[0], v.sizes[1], v.sizes[2]})};
}

/// An image whose element (y, x, channel) is what `value` gives.
inline HostTensor make_image(Shape shape,
                             const std::function<double(std::int64_t, std::int64_t, std::int64_t)>& value) {
  HostTensor image;
  image.shape = std::move(shape);
  for (std::int64_t y = 0; y < image.shape[0]; ++y)
    for (std::int64_t x = 0; x < image.shape[1]; ++x)
      for (std::int64_t c = 0; c < image.shape[2]; ++c) image.data.push_back(value(y, x, c));
  return image;
}

inline double pixel(const HostTensor& image, std::int64_t y, std::int64_t x, std::int64_t c) {
  return image.data[(y * image.shape[1] + x) * image.shape[2] + c];
}

}  // namespace vivant::cases
