#pragma once
#include "vivant/graph/launch.hpp"

namespace vivant {

/// Runs a kernel over (vectors of channels, x, y): on CPUs one work-item takes all channels of a pixel.
inline void run_over_pixels(Launch::Call& call, const Launch& launch, std::int64_t height, std::int64_t width,
                            std::int64_t channels) {
  const std::int64_t lanes = launch.vector_width();
  const std::size_t across = launch.gpu() ? static_cast<std::size_t>((channels + lanes - 1) / lanes) : 1;
  call.run({across, static_cast<std::size_t>(width), static_cast<std::size_t>(height)},
           launch.gpu() ? std::array<std::size_t, 3>{4, 16, 1} : std::array<std::size_t, 3>{1, 16, 1});
}

/// Channels that a work-item takes at a time: whole vectors, or single channels where these do not fit. The
/// macro LANES in kernels.
inline std::int64_t lanes_of(const Launch& launch, std::int64_t channels) {
  return channels % launch.vector_width() == 0 ? launch.vector_width() : 1;
}

inline void check_image(std::string_view op, const Shape& shape) {
  if (shape.rank() != 3) fail("[{}] x must be an image [H, W, C], it is {}", op, shape.text());
}

}  // namespace vivant
