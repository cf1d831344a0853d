#pragma once
#include <algorithm>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace vivant {

/// A host image [height, width, channels].
struct TileImage {
  std::int64_t height = 0, width = 0, channels = 0;
  std::vector<float> values;
};

/// The rectangle of an image, whose outermost pixels go on beyond its borders.
inline TileImage part(std::span<const float> from, std::int64_t height, std::int64_t width,
                      std::int64_t channels, const cv::Rect& at) {
  TileImage result{at.height, at.width, channels, {}};
  result.values.reserve(static_cast<std::size_t>(at.area()) * channels);
  for (std::int64_t i = 0; i < at.height; ++i)
    for (std::int64_t j = 0; j < at.width; ++j) {
      const std::int64_t row = std::clamp<std::int64_t>(at.y + i, 0, height - 1);
      const std::int64_t column = std::clamp<std::int64_t>(at.x + j, 0, width - 1);
      const auto pixel = from.subspan((row * width + column) * channels, channels);
      result.values.insert(result.values.end(), pixel.begin(), pixel.end());
    }
  return result;
}
inline TileImage part(const TileImage& from, const cv::Rect& at) {
  return part(from.values, from.height, from.width, from.channels, at);
}

/// Starts of tiles that cover `extent`; the last one is moved back so that it stays inside.
inline std::vector<std::int64_t> tile_starts(std::int64_t extent, std::int64_t tile) {
  std::vector<std::int64_t> starts;
  for (std::int64_t start = 0; start < extent; start += tile)
    starts.push_back(std::min(start, extent - tile));
  return starts;
}

inline cv::Rect tile_rectangle(std::int64_t top, std::int64_t left, std::int64_t rows, std::int64_t columns) {
  return {static_cast<int>(left), static_cast<int>(top), static_cast<int>(columns), static_cast<int>(rows)};
}

}  // namespace vivant
