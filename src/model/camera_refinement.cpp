#include "vivant/model/camera_refinement.hpp"

#include <Eigen/Geometry>
#include <map>

#include "vivant/model/field.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/reduction.hpp"

namespace vivant {
namespace {

using Eigen::Vector3d;

constexpr const char* parameter_name = "scene.camera_corrections";
constexpr int numbers = 6;

/// Moves the world's points as ray_correction moves a camera at `centre`.
Eigen::Isometry3d movement(const Vector3d& centre, const Vector3d& turn, const Vector3d& shift) {
  const Eigen::AngleAxisd rotation(2 * std::atan(turn.norm() / 2), turn.normalized());
  return Eigen::Translation3d(centre + shift) * rotation * Eigen::Translation3d(-centre);
}

/// Moves the whole body.
void move_pose(const Eigen::Isometry3d& movement, const Vector3d& rest_root, Pose& pose,
               Vector3d& translation) {
  pose[0] = axis_angle_from_rotation(movement.linear() * rotation_from_axis_angle(pose[0]));
  translation = movement * (rest_root + translation) - rest_root;
}

}  // namespace

CameraRefinement::CameraRefinement(ParameterStore& store, int training_frames, double unit)
    : store_(store), frames_(training_frames), unit_(unit) {
  store.add(parameter_name, {frames_, numbers}, group_cameras,
            std::vector<float>(static_cast<std::size_t>(frames_) * numbers, 0.0f));
}

Rays CameraRefinement::corrected(Graph& graph, const Rays& rays, Value pixels,
                                 std::int64_t frame_pixels) const {
  return ray_correction(rays, pixels, store_.value(graph, parameter_name), frame_pixels, unit_);
}

Value CameraRefinement::mean_square(Graph& graph) const {
  const Value corrections = store_.value(graph, parameter_name);
  return mean(multiply(corrections, corrections));
}

Capture CameraRefinement::corrected(const Capture& capture) const {
  const std::vector<float> learned = store_.read(parameter_name);
  Capture result = capture;
  std::map<int, int> shown;  // how many frames show a pose
  for (const CaptureFrame& frame : capture.frames) ++shown[frame.body_frame];
  const Vector3d rest_root =
      capture.human ? shaped(capture.human->body, capture.human->poses.shape).joints[0] : Vector3d::Zero();
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    Eigen::Vector<double, numbers> correction = Eigen::Vector<double, numbers>::Zero();
    for (const auto& [row, share] : capture.training_rows(static_cast<int>(i)))
      for (int k = 0; k < numbers; ++k) correction[k] += share * learned[row * numbers + k];
    CaptureFrame& frame = result.frames[i];
    const Eigen::Isometry3d moved =
        movement(frame.camera.centre(), correction.head<3>(), unit_ * correction.tail<3>());
    frame.camera.world_to_camera = frame.camera.world_to_camera * moved.inverse().matrix();
    if (!capture.human || frame.body_frame < 0 || shown[frame.body_frame] > 1) continue;
    Motion& poses = result.human->poses;
    move_pose(moved, rest_root, poses.pose[frame.body_frame], poses.translation[frame.body_frame]);
  }
  return result;
}

}  // namespace vivant
