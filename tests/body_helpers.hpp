#pragma once
#include "vivant/data/body.hpp"

namespace vivant {

/// A closed box [-0.25,0.25] x [0,3] x [-0.25,0.25] around a chain of three joints at heights 0, 1 and 2. The
/// lower four vertices follow joint 0, the upper four half joint 1, half joint 2. One shape direction doubles
/// the height.
inline Body chain_body() {
  Body body;
  for (int i = 0; i < 8; ++i)
    body.vertices.emplace_back(i & 1 ? 0.25 : -0.25, i & 4 ? 3 : 0, i & 2 ? 0.25 : -0.25);
  body.triangles = {{0, 1, 2}, {1, 3, 2}, {4, 6, 5}, {5, 6, 7}, {0, 4, 1}, {1, 4, 5},
                    {2, 3, 6}, {3, 7, 6}, {0, 2, 4}, {2, 6, 4}, {1, 5, 3}, {3, 5, 7}};
  body.joints = {{0, 0, 0}, {0, 1, 0}, {0, 2, 0}};
  body.parents = {-1, 0, 1};
  body.joint_names = {"root", "middle", "top"};
  body.influences = 2;
  for (int i = 0; i < 8; ++i) {
    const bool upper = i & 4;
    body.skin_joints.insert(body.skin_joints.end(), {upper ? 1 : 0, upper ? 2 : 0});
    body.skin_weights.insert(body.skin_weights.end(), {upper ? 0.5 : 1.0, upper ? 0.5 : 0.0});
  }
  body.shape_dirs.emplace_back();
  body.joint_dirs.emplace_back();
  for (const auto& vertex : body.vertices) body.shape_dirs[0].emplace_back(0, 0.5 * vertex.y(), 0);
  for (const auto& joint : body.joints) body.joint_dirs[0].emplace_back(0, 0.5 * joint.y(), 0);
  return body;
}

}  // namespace vivant
