#pragma once
#include <span>
#include <vector>

#include "vivant/data/camera.hpp"

namespace vivant {

/// Numbers of a row of a camera table: fx, fy, cx, cy, k1, k2, p1, p2, camera-to-world (3x4, row by row,
/// OpenCV axes).
inline constexpr int camera_table_columns = 20;

/// The rows [cameras, 20] that ray_generation reads. Throws when the cameras' images differ in size.
std::vector<float> camera_table(std::span<const Camera> cameras);

}  // namespace vivant
