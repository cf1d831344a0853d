#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Where the surface is that a ray sees: the depth of the sample that weighs most for its length (to the next
/// depth, as a part of that), as the mean with the samples before and behind it by weight; 0 on rays without
/// weight. weight as render_weights gives it and ascending depths, both [R, S] -> [R, 1]. Fog before a wall
/// moves the mean and the median depth, and not this one. No gradients.
Value peak_depth(Value weight, Value depths);

}  // namespace vivant
