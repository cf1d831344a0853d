#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

namespace vivant {

/// Tells whether points lie inside a closed mesh whose triangles are counter-clockwise from outside. Counts
/// the signed crossings of a ray along +z, so parts of the mesh may overlap each other.
class InsideMesh {
 public:
  InsideMesh(std::span<const Eigen::Vector3d> vertices, std::span<const Eigen::Vector3i> triangles);

  /// How many times the surface encloses the point: 1 inside, 0 outside, 2 where two parts overlap.
  int winding(const Eigen::Vector3d& point) const;
  bool contains(const Eigen::Vector3d& point) const { return winding(point) > 0; }

 private:
  int cell(double value, int axis) const;

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  Eigen::Vector2d origin_, cells_per_metre_;
  std::vector<int> starts_, members_;  // triangles over each cell of a grid on the xy plane
};

}  // namespace vivant
