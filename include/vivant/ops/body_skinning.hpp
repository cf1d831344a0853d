#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

// Transforms are affine maps as rows of 12 numbers: a row-major 3x4 matrix [A | t], x' = A x + t.

struct SkinnedBody {
  Value vertices;    ///< [V, 3] posed
  Value transforms;  ///< [V, 12] the blended transform of every vertex, rest -> posed
};

/// Linear blend skinning: T_v = sum_k w_vk T_joint(v,k), x_v = T_v [rest_v; 1]. rest [V, 3], transforms [J,
/// 12] (rest
/// -> posed, see joint_transforms), joints i32 [V, K], weights [V, K] whose rows sum to 1. Gradients to rest
/// and transforms.
SkinnedBody body_skinning(Value rest, Value transforms, Value joints, Value weights);

/// a after b, row by row: a, b [N, 12] -> [N, 12].
Value compose_transforms(Value a, Value b);

}  // namespace vivant
