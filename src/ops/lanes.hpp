#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>

#include "vivant/graph/launch.hpp"

namespace vivant {

/// How a kernel over kernels/lanes.clh walks along the channels: vectors of `lanes`, a power of two that
/// divides them.
struct Lanes {
  std::int64_t channels, lanes;
  bool gpu;

  Lanes(const Launch& launch, std::int64_t channels)
      : channels(channels),
        lanes(std::min<std::int64_t>(launch.vector_width(), channels & -channels)),
        gpu(launch.gpu()) {}
  std::int64_t vectors() const { return channels / lanes; }
  Defines defines(Defines more = {}) const {
    more.insert(more.end(), {{"CHANNELS", channels}, {"LANES", lanes}});
    return more;
  }
  /// Work-items: (vectors, rows). On CPUs one work-item takes all vectors of `block` rows; on GPUs one vector
  /// of one row.
  std::array<std::size_t, 3> items(std::int64_t rows, std::int64_t block = 1) const {
    if (gpu) return {static_cast<std::size_t>(vectors()), static_cast<std::size_t>(rows), 1};
    return {1, static_cast<std::size_t>((rows + block - 1) / block), 1};
  }
  std::array<std::size_t, 3> group() const {
    if (!gpu) return {1, 1, 1};
    const std::size_t across =
        std::min<std::size_t>(64, std::bit_ceil(static_cast<std::uint64_t>(vectors())));
    return {across, 64 / across, 1};
  }
};

}  // namespace vivant
