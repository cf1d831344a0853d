#include "vivant/data/inside_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace vivant {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

constexpr int grid_size = 128;

/// Whether the line from `point` towards +x crosses the edge (xy only). The half-open rule and the ordered
/// end points give neighbouring triangles the same answer for the edge they share, so that no ray slips
/// between them.
bool crosses(const Vector3d& point, const Vector3d& a, const Vector3d& b) {
  if ((a.y() > point.y()) == (b.y() > point.y())) return false;
  const bool ordered = a.y() < b.y();
  const Vector3d &low = ordered ? a : b, &high = ordered ? b : a;
  return point.x() < low.x() + (high.x() - low.x()) * ((point.y() - low.y()) / (high.y() - low.y()));
}

}  // namespace

InsideMesh::InsideMesh(std::span<const Vector3d> vertices, std::span<const Vector3i> triangles)
    : vertices_(vertices.begin(), vertices.end()), triangles_(triangles.begin(), triangles.end()) {
  Vector3d low = Vector3d::Constant(INFINITY), high = -low;
  for (const Vector3d& vertex : vertices_) low = low.cwiseMin(vertex), high = high.cwiseMax(vertex);
  origin_ = low.head<2>();
  cells_per_metre_ = grid_size * (high - low).head<2>().cwiseMax(1e-12).cwiseInverse();
  const auto for_each_cell = [&](const Vector3i& t, auto&& action) {
    const auto range = [&](int axis) {
      const auto [least, most] =
          std::minmax({vertices_[t[0]][axis], vertices_[t[1]][axis], vertices_[t[2]][axis]});
      return std::pair(cell(least, axis), cell(most, axis));
    };
    const auto [x0, x1] = range(0);
    const auto [y0, y1] = range(1);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) action(y * grid_size + x);
    }
  };
  starts_.assign(grid_size * grid_size + 1, 0);
  for (const Vector3i& t : triangles_) for_each_cell(t, [&](int at) { ++starts_[at + 1]; });
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  members_.resize(starts_.back());
  std::vector<int> next(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    for_each_cell(triangles_[i], [&](int at) { members_[next[at]++] = static_cast<int>(i); });
  }
}

int InsideMesh::cell(double value, int axis) const {
  return std::clamp(static_cast<int>(std::floor((value - origin_[axis]) * cells_per_metre_[axis])), 0,
                    grid_size - 1);
}

int InsideMesh::winding(const Vector3d& point) const {
  const int at = cell(point.y(), 1) * grid_size + cell(point.x(), 0);
  int count = 0;
  for (int i = starts_[at]; i < starts_[at + 1]; ++i) {
    const Vector3i& t = triangles_[members_[i]];
    const Vector3d &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
    if ((crosses(point, a, b) != crosses(point, b, c)) == crosses(point, c, a)) continue;
    const Vector3d normal = (b - a).cross(c - a);
    const double side = (point - a).dot(normal);  // > 0 outside of the triangle's plane
    // The triangle lies above the point when the point is on the side that the normal's z points away from.
    if (normal.z() > 0 && side < 0) ++count;
    if (normal.z() < 0 && side > 0) --count;
  }
  return count;
}

}  // namespace vivant
