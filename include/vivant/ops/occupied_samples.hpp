#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

struct OccupiedSamples {
  Value rows;   ///< i32 [R, S]: the row of a sample among those that are left, -1 for the others
  Value ids;    ///< i32 [R * S, 1]: the samples that are left, ascending; -1 behind the last
  Value count;  ///< i32 [1]: how many
};

/// The samples of rays that may weigh more than `threshold`, by bounds of the density: grid [D, H, W, 2] over
/// [-1, 1]^3 holds the least and the largest density of each cell (z, y, x); points [R S, 3], those outside
/// belong to the nearest cell; deltas [R, S] in the density's unit of length. Left out are samples whose
/// largest density times delta is at most the threshold, and those behind so much of the least density that
/// at most `threshold` of the light reaches them (early stop). What is left out weighs at most
/// (S + 1) * threshold on a ray, if the bounds hold. No gradient.
OccupiedSamples occupied_samples(Value grid, Value points, Value deltas, double threshold);

}  // namespace vivant
