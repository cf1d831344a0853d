#pragma once
#include <Eigen/Core>
#include <optional>

#include "vivant/data/motion.hpp"

namespace vivant {

/// A floor: points x with normal . x = offset. The normal has unit length and points up.
struct GroundPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  double offset = 0;

  double height_above(const Eigen::Vector3d& point) const { return normal.dot(point) - offset; }
};

/// The lowest vertex of the body in each frame of a motion (+y is up).
std::vector<Eigen::Vector3d> lowest_points(const Body& body, const Motion& motion);

/// The floor that feet stand on. A camera may be tilted in the world of the poses, so the plane is fitted to
/// the lowest points: by least squares, in which points off it count less (jumps, bad fits), and drawn
/// towards level, so that a person who stays in one place says nothing of a slope. Then it is lowered below
/// all but the lowest 5 % of the points. Absent for a plane steeper than 20 degrees: such a person stands on
/// no floor.
std::optional<GroundPlane> fitted_ground(const Body& body, const Motion& motion);

}  // namespace vivant
