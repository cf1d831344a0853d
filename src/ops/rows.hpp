#pragma once
#include "vivant/graph/launch.hpp"

namespace vivant {

/// Work-items for a kernel that gives one vector of VW elements to each, and their group size.
inline std::array<std::size_t, 3> vectors(const Launch& launch, std::int64_t elements) {
  const std::int64_t width = launch.vector_width();
  return {static_cast<std::size_t>((elements + width - 1) / width), 1, 1};
}
inline std::array<std::size_t, 3> vector_group() { return {64, 1, 1}; }

/// Runs a kernel over (vectors of channels, rows): on CPUs one work-item takes all channels of a row.
inline void run_over_rows(Launch::Call& call, const Launch& launch, std::int64_t rows,
                          std::int64_t channels) {
  call.run({launch.gpu() ? vectors(launch, channels)[0] : 1, static_cast<std::size_t>(rows), 1},
           launch.gpu() ? std::array<std::size_t, 3>{8, 8, 1} : std::array<std::size_t, 3>{1, 16, 1});
}

}  // namespace vivant
