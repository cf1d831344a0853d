#include "vivant/jobs/flow.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <opencv2/video/tracking.hpp>
#include <optional>

#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

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

/// The posed body of a view, to which the person's pixels belong.
class PosedBody {
 public:
  /// Without a person no pixel belongs to it.
  PosedBody(const Body* body, const SurfaceView& view, double units) : person_(view.person), units_(units) {
    if (!body || view.joints.empty() || person_.empty()) return;
    transforms_ = vertex_transforms(*body, view.joints);
    for (std::size_t v = 0; v < transforms_.size(); ++v)
      vertices_.push_back(transforms_[v] * body->vertices[v].homogeneous());
  }
  bool has(int y, int x) const { return !vertices_.empty() && person_.at<float>(y, x) > 0.5f; }
  /// The vertex that is nearest to a point in the cameras' unit.
  std::size_t vertex(const Eigen::Vector3d& point) const { return nearest(vertices_, point / units_); }
  /// The point, in the cameras' unit, brought to the rest pose with this vertex: in metres.
  Eigen::Vector3d at_rest(const Eigen::Vector3d& point, std::size_t vertex) const {
    const RigidTransform& from = transforms_[vertex];
    return from.leftCols<3>().inverse() * (point / units_ - from.col(3));
  }

 private:
  cv::Mat person_;
  double units_;
  Blends transforms_;
  std::vector<Eigen::Vector3d> vertices_;
};

/// The point that a pixel shows; none where nothing is.
std::optional<Eigen::Vector3d> point_at(const SurfaceView& view, int y, int x) {
  const double depth = view.depth.at<float>(y, x);
  if (!(depth > 0)) return std::nullopt;
  const Ray ray = view.camera.ray({x + 0.5, y + 0.5});
  return ray.origin + depth * ray.direction;
}

}  // namespace

cv::Mat dis_flow(const cv::Mat& from, const cv::Mat& to) {
  if (from.size() != to.size()) fail("the flow's two pictures have different sizes");
  cv::Mat flow;
  cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM)->calc(luma_of(from), luma_of(to), flow);
  return flow;
}

cv::Mat SurfaceFlow::flow(const SurfaceView& from, const SurfaceView& to) const {
  const PosedBody body(to.joints.empty() ? nullptr : body_, from, units_);
  const Blends after = body_ && !to.joints.empty() ? vertex_transforms(*body_, to.joints) : Blends();
  cv::Mat flow(from.depth.size(), CV_32FC2, cv::Scalar::all(unknown));
  for (int y = 0; y < flow.rows; ++y)
    for (int x = 0; x < flow.cols; ++x) {
      std::optional<Eigen::Vector3d> point = point_at(from, y, x);
      if (!point) continue;
      if (body.has(y, x)) {
        const std::size_t vertex = body.vertex(*point);
        point = units_ * (after[vertex] * body.at_rest(*point, vertex).homogeneous());
      }
      const Eigen::Vector3d seen = to.camera.project(*point);
      if (seen.z() <= 0) continue;
      flow.at<cv::Vec2f>(y, x) = {static_cast<float>(seen.x() - (x + 0.5)),
                                  static_cast<float>(seen.y() - (y + 0.5))};
    }
  return flow;
}

cv::Mat SurfaceFlow::rest_points(const SurfaceView& view) const {
  const PosedBody body(body_, view, units_);
  cv::Mat points(view.depth.size(), CV_32FC3, cv::Scalar::all(unknown));
  for (int y = 0; y < points.rows; ++y)
    for (int x = 0; x < points.cols; ++x) {
      std::optional<Eigen::Vector3d> point = point_at(view, y, x);
      if (!point) continue;
      if (body.has(y, x))
        point = units_ * (body.at_rest(*point, body.vertex(*point)) + Eigen::Vector3d(rest_apart, 0, 0));
      points.at<cv::Vec3f>(y, x) = {static_cast<float>(point->x()), static_cast<float>(point->y()),
                                    static_cast<float>(point->z())};
    }
  return points;
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
