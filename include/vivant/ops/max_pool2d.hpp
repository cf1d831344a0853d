#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// The largest value of each 2x2 window, stride 2: x [H, W, C] -> [H/2, W/2, C]. Odd extents are rounded
/// down, or with `ceil` up: the last window then has one row or column. The gradient goes to the first of the
/// largest values, row by row.
Value max_pool2d(Value x, bool ceil = false);

}  // namespace vivant
