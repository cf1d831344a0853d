#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "vivant/data/camera.hpp"

namespace vivant {

/// What a camera sees of a mesh: the nearest triangle at every pixel centre.
struct Visibility {
  int width = 0;
  int height = 0;
  std::vector<int> triangle;  ///< [height * width] index, -1 where there is none
  std::vector<float>
      inverse_depth;  ///< [height * width] 1/depth along the optical axis, 0 where there is none
};

/// Draws triangles into a depth buffer; those that reach behind the camera are left out. The lens's
/// distortion moves the corners, the edges between them stay straight.
Visibility rasterise(const Camera& camera, std::span<const Eigen::Vector3d> vertices,
                     std::span<const Eigen::Vector3i> triangles);

}  // namespace vivant
