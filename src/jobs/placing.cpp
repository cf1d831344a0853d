#include "vivant/jobs/placing.hpp"

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <string_view>

#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr const char* form = "a place is x,y,z,yaw or x,y,z,yaw,units, such as 0.5,0,-1,90";

}  // namespace

Place place_from(std::span<const double> numbers) {
  if (numbers.size() != 4 && numbers.size() != 5)
    throw UsageError(fmt::format("{}, not {} numbers", form, numbers.size()));
  for (const double number : numbers)
    if (!std::isfinite(number)) throw UsageError(fmt::format("{}: {} is not a finite number", form, number));
  const double units = numbers.size() == 5 ? numbers[4] : 1;
  if (!(units > 0)) throw UsageError(fmt::format("{}: {} units in a metre are not possible", form, units));
  return {{numbers[0], numbers[1], numbers[2]}, numbers[3], units};
}

Place place_from(const std::string& text) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const std::string_view part = std::string_view(text).substr(begin, comma - begin);
    double number = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
    if (error != std::errc() || end != part.data() + part.size())
      throw UsageError(fmt::format("{}, not '{}'", form, text));
    numbers.push_back(number);
    begin = comma + 1;
  }
  return place_from(numbers);
}

Vector3d standing_up(const Capture& capture) {
  const Vector3d up = up_direction(capture);
  int axis = 0;
  const double along = up.cwiseAbs().maxCoeff(&axis);
  if (along < std::cos(20 * M_PI / 180)) return up;
  return std::copysign(1.0, up[axis]) * Vector3d::Unit(axis);
}

Matrix3d turn_of_up(const Vector3d& from, const Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
}

Motion placed_in_scene(const Body& body, const Motion& motion, const Place& place, const Vector3d& up) {
  const Matrix3d turn = turn_of_up(Vector3d::UnitY(), up);
  const Vector3d ground = turn.transpose() * place.ground / place.units;
  Motion out = placed(body, motion, {ground.x(), ground.y(), ground.z(), place.yaw});
  if (turn.isIdentity()) return out;
  const Vector3d& root = body.joints[0];
  for (int frame = 0; frame < out.frame_count(); ++frame) {
    out.pose[frame][0] = axis_angle_from_rotation(turn * rotation_from_axis_angle(out.pose[frame][0]));
    out.translation[frame] = turn * (root + out.translation[frame]) - root;
  }
  return out;
}

}  // namespace vivant
