#include "vivant/data/motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "vivant/data/ground.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double ground_share = 1.0 / 3;  // of the frames, at least, in which a foot stands

Eigen::Quaterniond quaternion(const Vector3d& axis_angle) {
  return Eigen::Quaterniond(rotation_from_axis_angle(axis_angle));
}

double radians(double degrees) { return degrees * M_PI / 180; }

}  // namespace

std::vector<Vector3d> posed_vertices(const Body& body, const Motion& motion, int frame) {
  return posed_vertices(body, motion.pose[frame], motion.translation[frame]);
}

void check_motion(const Motion& motion, int joint_count, const std::string& source) {
  if (motion.pose.empty()) fail("{}: it holds no pose", source);
  if (!(motion.fps > 0) || !std::isfinite(motion.fps))
    fail("{}: a frame rate of {} is not possible", source, motion.fps);
  for (std::size_t frame = 0; frame < motion.pose.size(); ++frame) {
    const Pose& pose = motion.pose[frame];
    if (static_cast<int>(pose.size()) != joint_count) {
      fail("{}: frame {} has {} joints, the body has {}", source, frame, pose.size(), joint_count);
    }
    for (std::size_t joint = 0; joint < pose.size(); ++joint) {
      if (pose[joint].allFinite()) continue;
      const std::string name =
          joint < motion.joint_names.size() ? " (" + motion.joint_names[joint] + ")" : "";
      fail("{}: the pose of frame {}, joint {}{} is not finite", source, frame, joint, name);
    }
    if (!motion.translation[frame].allFinite())
      fail("{}: the translation of frame {} is not finite", source, frame);
  }
}

Motion resampled(const Motion& motion, double fps) {
  if (!(fps > 0) || !std::isfinite(fps)) fail("a frame rate of {} is not possible", fps);
  Motion out = motion;
  out.fps = fps;
  out.pose.clear();
  out.translation.clear();
  const int last = motion.frame_count() - 1;
  // The slack keeps the last frame when the two rates agree up to rounding.
  const int count = 1 + static_cast<int>(std::floor(last * fps / motion.fps + 1e-6));
  for (int i = 0; i < count; ++i) {
    const double time = std::min<double>(i * motion.fps / fps, last);
    const int before = static_cast<int>(time), after = std::min(before + 1, last);
    const double part = time - before;
    Pose pose(motion.pose[before].size());
    for (std::size_t j = 0; j < pose.size(); ++j) {
      const Vector3d &a = motion.pose[before][j], &b = motion.pose[after][j];
      pose[j] = part == 0
                    ? a
                    : axis_angle_from_rotation(quaternion(a).slerp(part, quaternion(b)).toRotationMatrix());
    }
    out.pose.push_back(std::move(pose));
    out.translation.push_back((1 - part) * motion.translation[before] + part * motion.translation[after]);
  }
  return out;
}

double ground_height(const Body& body, const Motion& motion) {
  std::vector<double> lowest;
  for (const Vector3d& point : lowest_points(body, motion)) lowest.push_back(point.y());
  std::sort(lowest.begin(), lowest.end());
  const auto inside = static_cast<std::ptrdiff_t>(ground_share * static_cast<double>(lowest.size() - 1));
  auto densest = lowest.begin();
  for (auto low = lowest.begin(); low + inside < lowest.end(); ++low)
    if (low[inside] - *low < densest[inside] - *densest) densest = low;
  return 0.5 * (*densest + densest[inside]);
}

double heading(const Vector3d& root_axis_angle) {
  const Vector3d forward = rotation_from_axis_angle(root_axis_angle).col(2);
  return std::atan2(forward.x(), forward.z()) * 180 / M_PI;
}

Placement standing_at(const Body& body, const Motion& motion, int frame) {
  const Vector3d root = body.joints[0] + motion.translation[frame];
  return {root.x(), ground_height(body, motion), root.z(), heading(motion.pose[frame][0])};
}

Motion placed(const Body& body, const Motion& motion, const Placement& placement) {
  const Placement start = standing_at(body, motion);
  const Matrix3d turn = rotation_from_axis_angle({0, radians(placement.yaw - start.yaw), 0});
  const Vector3d from(start.x, start.y, start.z), to(placement.x, placement.y, placement.z);
  Motion out = motion;
  for (int frame = 0; frame < motion.frame_count(); ++frame) {
    out.pose[frame][0] = axis_angle_from_rotation(turn * rotation_from_axis_angle(motion.pose[frame][0]));
    out.translation[frame] = turn * (body.joints[0] + motion.translation[frame] - from) + to - body.joints[0];
  }
  return out;
}

}  // namespace vivant
