#include "vivant/jobs/flow.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <opencv2/video/tracking.hpp>

#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

cv::Mat luma_of(const cv::Mat& rgb) {
  cv::Mat luma;
  cv::cvtColor(rgb, luma, cv::COLOR_RGB2GRAY);
  return luma;
}

/// Positions p + flow(p) as cv::remap reads them: pixel centres at whole numbers; far outside where nothing
/// is known.
cv::Mat positions(const cv::Mat& flow) {
  cv::Mat result = flow.clone();
  for (int y = 0; y < flow.rows; ++y)
    for (int x = 0; x < flow.cols; ++x) {
      cv::Vec2f& at = result.at<cv::Vec2f>(y, x);
      at = std::isfinite(at[0]) ? at + cv::Vec2f(static_cast<float>(x), static_cast<float>(y))
                                : cv::Vec2f(-10, -10);
    }
  return result;
}

float squared(const cv::Vec2f& v) { return v.dot(v); }

/// |d flow / dx|^2 + |d flow / dy|^2, forward differences.
float squared_gradient(const cv::Mat& flow, int y, int x) {
  const cv::Vec2f here = flow.at<cv::Vec2f>(y, x);
  const cv::Vec2f right = flow.at<cv::Vec2f>(y, std::min(x + 1, flow.cols - 1)),
                  below = flow.at<cv::Vec2f>(std::min(y + 1, flow.rows - 1), x);
  return squared(right - here) + squared(below - here);
}

using Blends = std::vector<RigidTransform>;

/// The transform of every vertex from rest to the pose.
Blends vertex_transforms(const Body& body, const std::vector<RigidTransform>& joints) {
  Blends blends(body.vertices.size(), RigidTransform::Zero());
  for (std::size_t v = 0; v < blends.size(); ++v)
    for (int k = 0; k < body.influences; ++k) {
      const std::size_t at = v * body.influences + k;
      blends[v] += body.skin_weights[at] * joints[body.skin_joints[at]];
    }
  return blends;
}

std::size_t nearest(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& to) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const double distance = (points[i] - to).squaredNorm(); distance < least) {
      least = distance;
      best = i;
    }
  return best;
}

/// A point moved from the pose `from` to the pose `to` with the vertex that both belong to.
Eigen::Vector3d carried(const Eigen::Vector3d& point, const RigidTransform& from, const RigidTransform& to) {
  const Eigen::Vector3d rest = from.leftCols<3>().inverse() * (point - from.col(3));
  return to * rest.homogeneous();
}

}  // namespace

cv::Mat dis_flow(const cv::Mat& from, const cv::Mat& to) {
  if (from.size() != to.size()) fail("the flow's two pictures have different sizes");
  cv::Mat flow;
  cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM)->calc(luma_of(from), luma_of(to), flow);
  return flow;
}

cv::Mat SurfaceFlow::flow(const SurfaceView& from, const SurfaceView& to) const {
  const bool person = body_ && !from.joints.empty() && !to.joints.empty() && !from.person.empty();
  Blends before, after;
  std::vector<Eigen::Vector3d> posed;
  if (person) {
    before = vertex_transforms(*body_, from.joints);
    after = vertex_transforms(*body_, to.joints);
    for (std::size_t v = 0; v < before.size(); ++v)
      posed.push_back(before[v] * body_->vertices[v].homogeneous());
  }
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  cv::Mat flow(from.depth.size(), CV_32FC2, cv::Scalar(unknown, unknown));
  for (int y = 0; y < flow.rows; ++y)
    for (int x = 0; x < flow.cols; ++x) {
      const double depth = from.depth.at<float>(y, x);
      if (!(depth > 0)) continue;
      const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
      const Ray ray = from.camera.ray(pixel);
      Eigen::Vector3d point = ray.origin + depth * ray.direction;
      if (person && from.person.at<float>(y, x) > 0.5f) {
        const std::size_t vertex = nearest(posed, point / units_);
        point = units_ * carried(point / units_, before[vertex], after[vertex]);
      }
      const Eigen::Vector3d seen = to.camera.project(point);
      if (seen.z() <= 0) continue;
      flow.at<cv::Vec2f>(y, x) = {static_cast<float>(seen.x() - pixel.x()),
                                  static_cast<float>(seen.y() - pixel.y())};
    }
  return flow;
}

cv::Mat visible_pixels(const cv::Mat& forward, const cv::Mat& backward) {
  const cv::Mat at = positions(forward);
  cv::Mat back;
  cv::remap(backward, back, at, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::Mat visible(forward.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < forward.rows; ++y)
    for (int x = 0; x < forward.cols; ++x) {
      const cv::Vec2f f = forward.at<cv::Vec2f>(y, x), b = back.at<cv::Vec2f>(y, x),
                      place = at.at<cv::Vec2f>(y, x);
      const bool inside = place[0] >= -0.5f && place[1] >= -0.5f &&
                          place[0] <= static_cast<float>(forward.cols) - 0.5f &&
                          place[1] <= static_cast<float>(forward.rows) - 0.5f;
      const bool seen = squared(f + b) <= 0.01f * (squared(f) + squared(b)) + 0.5f;  // false for NaN
      const bool smooth = squared_gradient(forward, y, x) <= 0.01f * squared(f) + 0.002f;
      if (inside && seen && smooth) visible.at<std::uint8_t>(y, x) = 255;
    }
  return visible;
}

cv::Mat warped(const cv::Mat& second, const cv::Mat& flow, cv::InterpolationFlags how) {
  cv::Mat result;
  cv::remap(second, result, positions(flow), {}, how, cv::BORDER_REPLICATE);
  return result;
}

}  // namespace vivant
