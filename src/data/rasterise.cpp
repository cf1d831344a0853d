#include "vivant/data/rasterise.hpp"

#include <algorithm>
#include <cmath>

namespace vivant {

using Eigen::Vector3d;
using Eigen::Vector3i;

Visibility rasterise(const Camera& camera, std::span<const Vector3d> vertices,
                     std::span<const Vector3i> triangles) {
  Visibility out{camera.width, camera.height, {}, {}};
  const std::size_t count = static_cast<std::size_t>(camera.width) * camera.height;
  out.triangle.assign(count, -1);
  out.inverse_depth.assign(count, 0.0F);
  std::vector<Vector3d> projected;
  for (const Vector3d& vertex : vertices) projected.push_back(camera.project(vertex));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vector3d &a = projected[triangles[t][0]], &b = projected[triangles[t][1]],
                   &c = projected[triangles[t][2]];
    if (std::min({a.z(), b.z(), c.z()}) <= 0.01) continue;
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    if (area == 0) continue;
    // Pixel centres are at +0.5.
    const int left = std::max(0, static_cast<int>(std::ceil(std::min({a.x(), b.x(), c.x()}) - 0.5)));
    const int right =
        std::min(out.width - 1, static_cast<int>(std::floor(std::max({a.x(), b.x(), c.x()}) - 0.5)));
    const int top = std::max(0, static_cast<int>(std::ceil(std::min({a.y(), b.y(), c.y()}) - 0.5)));
    const int bottom =
        std::min(out.height - 1, static_cast<int>(std::floor(std::max({a.y(), b.y(), c.y()}) - 0.5)));
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
