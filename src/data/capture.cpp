#include "vivant/data/capture.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "vivant/io/image.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Vector3d;

namespace {

constexpr double kept_points = 0.95;     // of each axis, against stray points
constexpr double body_margin = 1.0;      // metres around the joints' path
constexpr double rotation_limit = 1e-3;  // spread of the centres over the distance to the scene

std::vector<int> frames_where(const Capture& capture, bool held_out) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < capture.frames.size(); ++i) {
    if (capture.frames[i].held_out == held_out) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

void check_size(const cv::Mat& image, const CaptureFrame& frame, const std::filesystem::path& path) {
  if (image.cols == frame.camera.width && image.rows == frame.camera.height) return;
  fail("{}: the picture is {}x{}, its camera {}x{}", path.string(), image.cols, image.rows,
       frame.camera.width, frame.camera.height);
}

/// Positions of the person's joints in every frame that shows the person.
std::vector<Vector3d> joints_over_time(const Capture& capture) {
  std::vector<Vector3d> positions;
  if (!capture.human) return positions;
  const Body body = shaped(capture.human->body, capture.human->poses.shape);
  for (const CaptureFrame& frame : capture.frames) {
    if (frame.body_frame < 0) continue;
    const Motion& poses = capture.human->poses;
    const auto joints = posed_joints(
        body, joint_transforms(body, poses.pose[frame.body_frame], poses.translation[frame.body_frame]));
    positions.insert(positions.end(), joints.begin(), joints.end());
  }
  return positions;
}

Box bounds(const std::vector<Vector3d>& points) {
  Box box{points[0], points[0]};
  for (const Vector3d& point : points) {
    box.min = box.min.cwiseMin(point);
    box.max = box.max.cwiseMax(point);
  }
  return box;
}

/// Per axis the interval of the middle 95 % of the points.
Box middle_bounds(const std::vector<Eigen::Vector3f>& points) {
  Box box;
  std::vector<float> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    std::sort(values.begin(), values.end());
    const auto cut = static_cast<std::size_t>((1 - kept_points) / 2 * static_cast<double>(values.size()));
    box.min[axis] = values[cut];
    box.max[axis] = values[values.size() - 1 - cut];
  }
  return box;
}

/// Catmull-Rom's spline through one value for each of `frames`, at `frame` between rows `after` - 1 and
/// `after`: the rows' shares. Its slope at a row is that between the rows around it, at the first and last
/// row that of the interval itself.
std::vector<std::pair<int, double>> spline_shares(const std::vector<int>& frames, int after, int frame) {
  const int before = after - 1, last = static_cast<int>(frames.size()) - 1;
  const double length = frames[after] - frames[before], u = (frame - frames[before]) / length;
  std::map<int, double> shares;
  shares[after] = u * u * (3 - 2 * u);
  shares[before] = 1 - shares[after];
  const auto add_slope = [&](int row, double factor) {
    const int from = std::max(row - 1, 0), to = std::min(row + 1, last);
    const double slope = factor * length / (frames[to] - frames[from]);
    shares[to] += slope;
    shares[from] -= slope;
  };
  add_slope(before, u * (1 - u) * (1 - u));
  add_slope(after, -u * u * (1 - u));
  return {shares.begin(), shares.end()};
}

}  // namespace

std::vector<int> Capture::all_frames() const {
  std::vector<int> all(frames.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}
std::vector<int> Capture::training_frames() const { return frames_where(*this, false); }
std::vector<int> Capture::held_out_frames() const { return frames_where(*this, true); }

std::vector<std::pair<int, double>> Capture::training_rows(int frame) const {
  const std::vector<int> trained = training_frames();
  const auto after = std::lower_bound(trained.begin(), trained.end(), frame);
  if (after == trained.end()) return {{static_cast<int>(trained.size()) - 1, 1.0}};
  const int row = static_cast<int>(after - trained.begin());
  if (*after == frame || row == 0) return {{row, 1.0}};
  return spline_shares(trained, row, frame);
}

void Exposure::apply(std::span<float> colours) const {
  for (std::size_t i = 0; i < colours.size(); ++i)
    colours[i] = static_cast<float>(gain[i % 3] * colours[i] + offset[i % 3]);
}

cv::Mat Exposure::removed(const cv::Mat& taken) const {
  if ((gain == 1).all() && (offset == 0).all()) return taken;
  cv::Matx34d colours = cv::Matx34d::zeros();
  for (int c = 0; c < 3; ++c) {
    colours(c, c) = 1 / gain[c];
    colours(c, 3) = -255 * offset[c] / gain[c];
  }
  cv::Mat shared;
  cv::transform(taken, shared, colours);
  return shared;
}

cv::Mat Capture::image(int frame) const { return frames.at(frame).exposure.removed(taken_image(frame)); }

cv::Mat Capture::taken_image(int frame) const {
  const CaptureFrame& at = frames.at(frame);
  cv::Mat image = read_image(at.image_path);
  check_size(image, at, at.image_path);
  return image;
}

cv::Mat Capture::soft_mask(int frame) const {
  const CaptureFrame& at = frames.at(frame);
  if (at.mask_name.empty()) return cv::Mat::zeros(at.camera.height, at.camera.width, CV_8UC1);
  cv::Mat mask = read_mask(at.mask_path);
  check_size(mask, at, at.mask_path);
  if (cv::countNonZero(mask > 1) == 0) mask *= 255;  // stored as 0 and 1
  if (at.mask_keeps) cv::bitwise_not(mask, mask);
  return mask;
}

cv::Mat Capture::mask(int frame) const {
  return soft_mask(frame) > 127;  // half of the pixel
}

Box derived_scene_box(const Capture& capture) {
  if (!capture.points.positions.empty()) {
    std::vector<Vector3d> corners;
    corners.reserve(capture.frames.size() + 2);
    for (const CaptureFrame& frame : capture.frames) corners.push_back(frame.camera.centre());
    const Box middle = middle_bounds(capture.points.positions);
    corners.insert(corners.end(), {middle.min, middle.max});
    return bounds(corners);
  }
  const std::vector<Vector3d> joints = joints_over_time(capture);
  if (joints.empty()) {
    fail(
        "{}: no scene box can be derived without sparse points ('ply_file_path') or a person; add "
        "'scene_box': "
        "[[min x, y, z], [max x, y, z]]",
        capture.source.string());
  }
  Box box = bounds(joints);
  box.min.array() -= body_margin;
  box.max.array() += body_margin;
  return box;
}

Vector3d up_direction(const Capture& capture) {
  if (capture.human) return Vector3d::UnitY();
  Vector3d sum = Vector3d::Zero();
  for (const CaptureFrame& frame : capture.frames)
    sum -= frame.camera.world_to_camera.row(1).head<3>().transpose();
  if (sum.norm() < 0.1 * static_cast<double>(capture.frames.size())) return Vector3d::UnitY();
  return sum.normalized();
}

Vector3d focus_point(const Capture& capture) {
  const std::vector<Vector3d> joints = joints_over_time(capture);
  if (!joints.empty()) return bounds(joints).centre();
  // Least squares: the sum over the axes of (I - d d^T)(x - c) is zero; the small ridge settles parallel
  // axes.
  Eigen::Matrix3d matrix = 1e-6 * Eigen::Matrix3d::Identity();
  Vector3d right = Vector3d::Zero();
  for (const CaptureFrame& frame : capture.frames) {
    const Vector3d axis = frame.camera.forward(), centre = frame.camera.centre();
    const Eigen::Matrix3d projection = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    matrix += projection;
    right += projection * centre + 1e-6 * (centre + axis);
  }
  return matrix.ldlt().solve(right);
}

bool camera_only_rotates(const Capture& capture) {
  Vector3d mean = Vector3d::Zero();
  for (const CaptureFrame& frame : capture.frames) mean += frame.camera.centre() / capture.frames.size();
  double spread = 0;
  for (const CaptureFrame& frame : capture.frames)
    spread = std::max(spread, (frame.camera.centre() - mean).norm());
  std::vector<double> distances;
  distances.reserve(capture.points.positions.size());
  for (const Eigen::Vector3f& point : capture.points.positions) {
    distances.push_back((point.cast<double>() - mean).norm());
  }
  if (distances.empty()) {
    for (const Vector3d& joint : joints_over_time(capture)) distances.push_back((joint - mean).norm());
  }
  if (distances.empty()) return spread < 1e-6;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return spread < rotation_limit * *middle;
}

}  // namespace vivant
