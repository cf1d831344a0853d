#pragma once
#include <Eigen/Core>

#include "vivant/graph/graph.hpp"

namespace vivant {

/// Trilinear samples of a grid [D, H, W] (z, y, x) whose first and last nodes lie on the faces of the box
/// (low, high): points [N, 3] -> [N, 1]. Points outside take the value of the closest point of the box. N may
/// carry a device-side count. No gradient.
Value sample_grid(Value grid, Value points, const Eigen::Vector3d& low, const Eigen::Vector3d& high);

}  // namespace vivant
