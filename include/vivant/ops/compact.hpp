#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

struct Compacted {
  Value ids;       ///< i32 [capacity]: ascending indices; -1 behind the last
  Value rows;      ///< i32 [capacity]: the row of each in a weight [rows, channels]; -1 behind the last
  Value count;     ///< i32 [1]: how many there are, at most the capacity
  Value overflow;  ///< i32 [1]: 1 when there were more than the capacity, so that the step must be repeated
                   ///< with more
};

/// The indices of the elements of `weight` (any shape) above `threshold`, by a prefix sum in fixed order. No
/// gradient: which elements are taken is not differentiable.
Compacted compact(Value weight, double threshold, std::int64_t capacity);

}  // namespace vivant
