#include "vivant/model/scene_space.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vivant/data/ground.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

using Eigen::Vector3d;

double quantile(std::vector<double> values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

template <typename Number>
std::vector<double> numbers_of(const PointCloud& cloud, const Number& number) {
  std::vector<double> numbers(cloud.positions.size());
  std::transform(cloud.positions.begin(), cloud.positions.end(), numbers.begin(), number);
  return numbers;
}

/// Depths of the sparse points in the cameras that see them; empty without points.
std::vector<double> seen_depths(const Capture& capture) {
  std::vector<double> depths;
  const std::size_t stride = std::max<std::size_t>(1, capture.points.positions.size() / 2000);
  for (const CaptureFrame& frame : capture.frames)
    for (std::size_t p = 0; p < capture.points.positions.size(); p += stride) {
      const Vector3d& point = capture.points.positions[p].cast<double>();
      const Vector3d pixel = frame.camera.project(point);
      if (pixel.z() > 0 && pixel.x() >= 0 && pixel.x() < frame.camera.width && pixel.y() >= 0 &&
          pixel.y() < frame.camera.height)
        depths.push_back((point - frame.camera.centre()).norm());
    }
  return depths;
}

/// The farthest that a point of the person comes to a camera, 0 without a person.
double person_distance(const Capture& capture) {
  double farthest = 0;
  if (!capture.human) return farthest;
  for (const CaptureFrame& frame : capture.frames)
    if (frame.body_frame >= 0)
      farthest =
          std::max(farthest, (capture.human->body.joints[0] +
                              capture.human->poses.translation[frame.body_frame] - frame.camera.centre())
                                 .norm());
  return farthest;
}

constexpr double floor_thickness = 0.05;  // of the camera's height: what of a floor's depth stays open
constexpr double least_height = 0.1;      // metres of the camera above a floor that can be seen from there

/// Around the first camera, between near and far.
Shell shell_around(const Capture& capture, const SceneSpace& space, bool with_ground) {
  const Vector3d centre = capture.frames.front().camera.centre();
  Shell shell{.centre = array_of(centre), .inner_radius = space.near, .outer_radius = space.far};
  if (!with_ground || !capture.human) return shell;
  const Motion& poses = capture.human->poses;
  Motion seen;
  for (const CaptureFrame& frame : capture.frames) {
    if (frame.body_frame < 0) continue;
    seen.pose.push_back(poses.pose[frame.body_frame]);
    seen.translation.push_back(poses.translation[frame.body_frame]);
  }
  if (seen.pose.empty()) return shell;
  const auto ground = fitted_ground(shaped(capture.human->body, poses.shape), seen);
  if (!ground || ground->height_above(centre) < least_height) return shell;
  shell.up = array_of(ground->normal);
  shell.inner_floor = ground->height_above(centre);
  shell.outer_floor = (1 + floor_thickness) * shell.inner_floor;
  return shell;
}

/// The box of all that the cameras see of the shell.
void set_box_of_shell(SceneSpace& space, const Capture& capture) {
  const Shell& shell = *space.shell;
  // A tilted floor's far end lies anywhere in a picture. Without a floor nine rays do, as in older runs.
  const int steps = shell.has_floor() ? 32 : 2;
  const double parts = steps;
  const Vector3d up(shell.up[0], shell.up[1], shell.up[2]);
  Vector3d low = Vector3d::Constant(1e30), high = -low;
  for (const CaptureFrame& frame : capture.frames)
    for (int i = 0; i < (steps + 1) * (steps + 1); ++i) {
      const Camera& camera = frame.camera;
      const int row = i / (steps + 1), column = i % (steps + 1);
      const Ray ray = camera.ray({column * camera.width / parts, row * camera.height / parts});
      const double falling = std::max(-up.dot(ray.direction), 1e-9);
      for (const double depth : {std::min(shell.inner_radius, shell.inner_floor / falling),
                                 std::min(shell.outer_radius, shell.outer_floor / falling)}) {
        const Vector3d point = ray.origin + depth * ray.direction;
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
      }
    }
  space.centre = 0.5 * (low + high);
  space.radius = 0.51 * (high - low);
}

void set_depth_range(SceneSpace& space, const Capture& capture) {
  const std::vector<double> depths = seen_depths(capture);
  if (!depths.empty()) {
    space.near = 0.7 * quantile(depths, 0.005);
    space.far = 1.3 * quantile(depths, 0.99);
    return;
  }
  double farthest = 0;
  for (const CaptureFrame& frame : capture.frames)
    farthest = std::max(farthest, (frame.camera.centre() - space.centre).norm());
  space.near = 0.02 * space.radius.norm();
  space.far = farthest + space.radius.norm();
}

}  // namespace

SceneSpace scene_space(const Capture& capture, const SceneSpaceOptions& options) {
  SceneSpace space;
  std::string shape = options.shape;
  if (shape == "auto")
    shape = camera_only_rotates(capture)       ? "shell"
            : capture.scene_box_given          ? "box"
            : capture.points.positions.empty() ? "box"
                                               : "contraction";
  if (shape == "shell") {
    const double person = person_distance(capture);
    space.near = person > 0 ? 1.3 * person + 2 : 20;
    space.far = 1.3 * space.near;
  } else if (shape == "box") {
    space.centre = capture.scene_box.centre();
    space.radius = 0.5 * capture.scene_box.size();
    space.bounded = capture.scene_box_given;
    set_depth_range(space, capture);
  } else if (shape == "contraction") {
    if (capture.points.positions.empty()) {
      space.centre = capture.scene_box.centre();
    } else {
      for (int axis = 0; axis < 3; ++axis) {
        space.centre[axis] = quantile(
            numbers_of(capture.points, [&](const Eigen::Vector3f& point) { return point[axis]; }), 0.5);
      }
    }
    const std::vector<double> distances = numbers_of(capture.points, [&](const Eigen::Vector3f& point) {
      return (point.cast<double>() - space.centre).cwiseAbs().maxCoeff();
    });
    const double radius =
        distances.empty() ? 0.25 * capture.scene_box.size().maxCoeff() : quantile(distances, 0.75);
    space.radius = Vector3d::Constant(radius);
    space.contracted = true;
    set_depth_range(space, capture);
  } else {
    throw UsageError(
        fmt::format("unknown scene shape '{}': use auto, box, contraction or shell", options.shape));
  }
  if (options.near > 0) space.near = options.near;
  if (options.far > 0) space.far = options.far;
  if (!(space.far > space.near && space.near > 0))
    throw UsageError(
        fmt::format("the scene's rays run from {:.3g} to {:.3g}: near must be positive and below far",
                    space.near, space.far));
  if (shape == "shell") {
    space.shell = shell_around(capture, space, options.ground);
    set_box_of_shell(space, capture);
  }
  if (options.radius > 0) space.radius = Vector3d::Constant(options.radius);
  return space;
}

}  // namespace vivant
