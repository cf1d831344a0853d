#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

struct CanonicalSamples {
  Value points;      ///< [N, 3]
  Value inside;      ///< [N, 1] 1; 0 where there is no face or the blended transform cannot be inverted
  Value directions;  ///< [N, 3] unit length; absent without directions
};

/// Coordinate of canonical points that do not exist (inside = 0): far outside of every canonical box.
constexpr double no_canonical_point = 1e3;

/// The inverse linear-blend-skinning warp x~ = (sum_k b_k V_k)^-1 x of NeuMan and of the paper's human field:
/// points [N, 3] and optional directions [N, 3] in the observation; faces i32 [N, 1] (-1: none) and
/// barycentric [N, 3] weights of their closest points on the posed body; triangles i32 [F, 3]; transforms [V,
/// 12] of the vertices, canonical pose
/// -> observation. Blends whose determinant is below 0.02 count as not invertible. Gradients to points,
/// directions and transforms; faces and weights are held fixed. N may carry a device-side count.
CanonicalSamples inverse_warp(Value points, Value directions, Value faces, Value barycentric, Value triangles,
                              Value transforms);

}  // namespace vivant
