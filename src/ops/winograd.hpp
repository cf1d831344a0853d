#pragma once
#include "ops/tiles.hpp"
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Tiles of 4x4 pixels that cover an image [H, W, C].
inline std::int64_t winograd_tiles(std::int64_t height, std::int64_t width) {
  return (height + 3) / 4 * ((width + 3) / 4);
}
inline std::int64_t winograd_tiles(const Shape& image) { return winograd_tiles(image[0], image[1]); }

}  // namespace vivant
