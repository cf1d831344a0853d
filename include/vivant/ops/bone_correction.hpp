#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// How the joints move the points of a mesh.
struct SkinTables {
  Value triangles;  ///< i32 [F, 3]
  Value joints;     ///< i32 [V, K]
  Value weights;    ///< [V, K], rows sum to 1
  Value centres;    ///< [J, 3] positions of the joints
};

/// Small corrections of a frame's bones, blended like the skin (an addition to the paper's error correction):
///   e = sum_k w_k (rotation_k x (x - centre_k) + translation_k)
/// points x [N, 3]; face i32 [N, 1] and barycentric [N, 3] name the place on the mesh whose joints and
/// weights count (face -1: e = 0); frame i32 [N, 1]; codes [frames, J, 6], rotation (a small angle, as a
/// vector) and translation of every joint. -> e [N, 3]. Rows may carry a device-side count. Gradients to
/// points and codes.
Value bone_correction(Value points, Value face, Value barycentric, Value frame, Value codes,
                      const SkinTables& tables);

}  // namespace vivant
