#include "vivant/data/rasterise.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vivant {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

constexpr double nearest = 0.01;  // depth from which triangles are drawn

/// The first and the last of `count` pixels whose centres, at +0.5, lie between the least and the greatest of
/// the coordinates; limited before they become integers, which cannot hold them all.
std::pair<int, int> covered(std::initializer_list<double> coordinates, int count) {
  const double first = std::ceil(std::min(coordinates) - 0.5), last = std::floor(std::max(coordinates) - 0.5);
  return {static_cast<int>(std::clamp<double>(first, 0, count)),
          static_cast<int>(std::clamp<double>(last, -1, count - 1))};
}

/// Camera::project, with depth 0 for what strong distortion folds back into the picture from far outside.
Vector3d in_picture(const Camera& camera, const Vector3d& vertex) {
  Vector3d place = camera.project(vertex);
  if (!camera.distorted() || place.z() <= nearest) return place;
  const Ray back = camera.ray(place.head<2>());
  if (((vertex - back.origin).normalized() - back.direction).norm() > 0.01) place.z() = 0;
  return place;
}

}  // namespace

Visibility rasterise(const Camera& camera, std::span<const Vector3d> vertices,
                     std::span<const Vector3i> triangles) {
  Visibility out{camera.width, camera.height, {}, {}};
  const std::size_t count = static_cast<std::size_t>(camera.width) * camera.height;
  out.triangle.assign(count, -1);
  out.inverse_depth.assign(count, 0.0F);
  std::vector<Vector3d> projected;
  for (const Vector3d& vertex : vertices) projected.push_back(in_picture(camera, vertex));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vector3d &a = projected[triangles[t][0]], &b = projected[triangles[t][1]],
                   &c = projected[triangles[t][2]];
    if (std::min({a.z(), b.z(), c.z()}) <= nearest) continue;
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    if (area == 0) continue;
    const auto [left, right] = covered({a.x(), b.x(), c.x()}, out.width);
    const auto [top, bottom] = covered({a.y(), b.y(), c.y()}, out.height);
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        const double x = column + 0.5, y = row + 0.5;
        const double at_a = ((b.x() - x) * (c.y() - y) - (b.y() - y) * (c.x() - x)) / area;
        const double at_b = ((c.x() - x) * (a.y() - y) - (c.y() - y) * (a.x() - x)) / area;
        const double at_c = 1 - at_a - at_b;
        if (at_a < 0 || at_b < 0 || at_c < 0) continue;
        const auto inverse = static_cast<float>(at_a / a.z() + at_b / b.z() + at_c / c.z());
        const std::size_t pixel = static_cast<std::size_t>(row) * out.width + column;
        if (inverse <= out.inverse_depth[pixel]) continue;
        out.inverse_depth[pixel] = inverse;
        out.triangle[pixel] = static_cast<int>(t);
      }
    }
  }
  return out;
}

}  // namespace vivant
