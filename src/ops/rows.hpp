#pragma once
#include "vivant/graph/launch.hpp"

namespace vivant {

/// Work-items for a kernel that gives one vector of VW elements to each, and their group size.
inline std::array<std::size_t, 3> vectors(const Launch& launch, std::int64_t elements) {
  const std::int64_t width = launch.vector_width();
  return {static_cast<std::size_t>((elements + width - 1) / width), 1, 1};
}
inline std::array<std::size_t, 3> vector_group() { return {64, 1, 1}; }

}  // namespace vivant
