#include <Eigen/Geometry>
#include <numbers>

#include "cases/bumpy_sphere.hpp"
#include "cases/op_case.hpp"
#include "vivant/ops/closest_point.hpp"

namespace vivant::cases {
namespace {

using Eigen::Vector3d;
constexpr std::int64_t width = MeshTopology::width;

// sizes: quads along and around a torus with waves; 16 leaves or 256 leave no child of a node missing (a
// missing one's box is +-1e18, beside which the tolerance sees no other)
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const int along = static_cast<int>(v.sizes[0]), around = static_cast<int>(v.sizes[1]);
  std::vector<Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  for (int i = 0; i < along; ++i)
    for (int k = 0; k < around; ++k) {
      const double a = 2 * std::numbers::pi * i / along, b = 2 * std::numbers::pi * k / around;
      const double radius = 0.4 + 0.1 * std::sin(3 * a + b) + random.uniform(0, 0.02);
      vertices.emplace_back((1 + radius * std::cos(b)) * std::cos(a),
                            (1 + radius * std::cos(b)) * std::sin(a), radius * std::sin(b));
      const auto at = [&](int row, int column) { return row % along * around + column % around; };
      triangles.emplace_back(at(i, k), at(i + 1, k), at(i + 1, k + 1));
      triangles.emplace_back(at(i, k), at(i + 1, k + 1), at(i, k + 1));
    }
  const MeshTopology topology = mesh_topology(vertices, triangles);
  HostTensor posed = fixed_tensor(DType::real, {topology.vertex_count, 3});
  for (const Vector3d& x : vertices)
    posed.data.insert(posed.data.end(), {1.3 * x.x(), x.y() + 0.2 * x.x(), x.z()});
  return {posed, integer_rows(topology.triangles, 3), integer_rows(topology.leaf_triangles, width),
          integer_rows(topology.corner_offsets, 1), integer_rows(topology.corners, 1)};
}

Vector3d vertex(const HostTensor& vertices, double index) {
  return Vector3d(vertices.data.data() + 3 * static_cast<std::int64_t>(index));
}

/// Writes a box of each child into rows of [nodes, 6, 16], then those of the nodes above, up to a single
/// root.
void write_bounds(std::vector<Eigen::AlignedBox3d> boxes, HostTensor& bounds) {
  std::int64_t node = 0;
  do {
    std::vector<Eigen::AlignedBox3d> parents;
    for (std::size_t first = 0; first < boxes.size(); first += width, ++node) {
      parents.emplace_back();
      bounds.data.resize((node + 1) * 6 * width);
      for (std::int64_t lane = 0; lane < width; ++lane) {
        const bool missing = first + lane >= boxes.size();
        if (!missing) parents.back().extend(boxes[first + lane]);
        for (int row = 0; row < 6; ++row) {
          const double limit = row < 3 ? 1e18 : -1e18;
          bounds.data[(node * 6 + row) * width + lane] = missing   ? limit
                                                         : row < 3 ? boxes[first + lane].min()[row]
                                                                   : boxes[first + lane].max()[row - 3];
        }
      }
    }
    boxes = parents;
  } while (boxes.size() > 1);
  bounds.shape = {node, 6, width};
}

HostTensor normals_of(const HostTensor& vertices, const HostTensor& triangles) {
  std::vector<Vector3d> corners;
  std::vector<Eigen::Vector3i> faces;
  for (std::size_t v = 0; v < vertices.data.size(); v += 3) corners.emplace_back(vertices.data.data() + v);
  for (std::size_t t = 0; t < triangles.data.size(); t += 3)
    faces.push_back(Vector3d(triangles.data.data() + t).cast<int>());
  HostTensor normals = fixed_tensor(DType::real, vertices.shape);
  for (const Vector3d& normal : angle_weighted_normals(corners, faces))
    normals.data.insert(normals.data.end(), {normal.x(), normal.y(), normal.z()});
  return normals;
}

std::vector<HostTensor> reference(const Variation&, const std::vector<HostTensor>& in) {
  const std::int64_t count = in[2].shape[0];
  HostTensor leaves = fixed_tensor(DType::real, {count, 13, width}), bounds = fixed_tensor(DType::real, {});
  leaves.data.resize(count * 13 * width);
  std::vector<Eigen::AlignedBox3d> boxes(count);
  for (std::int64_t leaf = 0; leaf < count; ++leaf)
    for (std::int64_t lane = 0; lane < width; ++lane) {
      const double* corners =
          in[1].data.data() + 3 * static_cast<std::int64_t>(in[2].data[leaf * width + lane]);
      const Vector3d a = vertex(in[0], corners[0]), b = vertex(in[0], corners[1]),
                     c = vertex(in[0], corners[2]);
      const Vector3d ab = b - a, ac = c - a;
      const double rows[13] = {a.x(),
                               a.y(),
                               a.z(),
                               ab.x(),
                               ab.y(),
                               ab.z(),
                               ac.x(),
                               ac.y(),
                               ac.z(),
                               1 / ab.squaredNorm(),
                               1 / ac.squaredNorm(),
                               1 / (c - b).squaredNorm(),
                               1 / ab.cross(ac).squaredNorm()};
      for (int row = 0; row < 13; ++row) leaves.data[(leaf * 13 + row) * width + lane] = rows[row];
      for (const Vector3d& corner : {a, b, c}) boxes[leaf].extend(corner);
    }
  write_bounds(boxes, bounds);
  return {leaves, bounds, normals_of(in[0], in[1])};
}

const Register register_mesh_refit(OpCase{
    .op = "mesh_refit",
    .variations = {{{3, 3}}, {{16, 8}}, {{19, 11}}, {{64, 32}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{128, 64}},
    .bytes = [](const Variation& v) { return 4.0 * 2 * 13 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
