#pragma once
#include <span>
#include <string>

#include "vivant/data/capture.hpp"

namespace vivant {

/// Where a person stands in the world of a scene's capture. A world without a person of its own may have any
/// unit and any up.
struct Place {
  Eigen::Vector3d ground = Eigen::Vector3d::Zero();  ///< the ground below the root of the first frame
  double yaw = 0;    ///< degrees about the scene's up; with y up 0 faces +z and 90 faces +x
  double units = 1;  ///< of the scene's world in a metre

  bool operator==(const Place&) const = default;
};

/// x, y, z, yaw and optionally the units. Throws UsageError for other counts, numbers that are not finite and
/// units that are not positive.
Place place_from(std::span<const double> numbers);
/// The same from "x,y,z,yaw" or "x,y,z,yaw,units".
Place place_from(const std::string& text);

/// The up of people in a capture's world: up_direction, or the world's axis within 20 degrees of it, since
/// photographers point their cameras a little down.
Eigen::Vector3d standing_up(const Capture& capture);

/// The smallest rotation that turns one up into another.
Eigen::Matrix3d turn_of_up(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// The motion (metres, y up) standing at `place`: in the axes of the scene's world, but in metres still, that
/// is scene positions divided by place.units. Turned by the smallest rotation from +y to `up`.
Motion placed_in_scene(const Body& body, const Motion& motion, const Place& place, const Eigen::Vector3d& up);

}  // namespace vivant
