#include "vivant/ops/closest_point.hpp"

#include "cases/bumpy_sphere.hpp"
#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

using Eigen::Vector3d;

// Close to the inside of a random triangle, so that the closest triangle is unique; every fifth point is far
// away.
Vector3d query(const TriangleMesh& mesh, int index, Random& random) {
  const auto& t = mesh.triangles[random.integer(static_cast<std::int64_t>(mesh.triangles.size()))];
  const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
  const double u = random.uniform(0.2, 0.4), v = random.uniform(0.2, 0.4);
  const Vector3d normal = (b - a).cross(c - a);
  if (index % 5 == 4) return 3 * (a + normal);
  return a + u * (b - a) + v * (c - a) + random.uniform(-0.1, 0.1) * normal / std::sqrt(normal.norm());
}

// sizes: subdivisions, points, live points (-1: all)
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const TriangleMesh mesh = bumpy_sphere(static_cast<int>(v.sizes[0]));
  const MeshTopology topology = mesh_topology(mesh.vertices, mesh.triangles);
  HostTensor points, vertices;
  points.shape = {v.sizes[1], 3};
  points.live_rows = v.sizes[2];
  for (int i = 0; i < v.sizes[1]; ++i) {
    const Vector3d p = query(mesh, i, random);
    points.data.insert(points.data.end(), {p.x(), p.y(), p.z()});
  }
  vertices.shape = {topology.vertex_count, 3};
  for (const Vector3d& p : mesh.vertices) vertices.data.insert(vertices.data.end(), {p.x(), p.y(), p.z()});
  points.differentiable = vertices.differentiable = false;
  return {points,
          vertices,
          integer_rows(topology.triangles, 3),
          integer_rows(topology.leaf_triangles, MeshTopology::width),
          integer_rows(topology.neighbours, 3),
          integer_rows(topology.corner_offsets, 1),
          integer_rows(topology.corners, 1)};
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const TriangleMesh mesh = bumpy_sphere(static_cast<int>(v.sizes[0]));
  const double max_distance = v.attributes.value("max_distance", 0.1);
  const std::int64_t points = v.sizes[1], live = v.sizes[2] < 0 ? points : v.sizes[2];
  HostTensor face, barycentric, distance, closest;
  face.dtype = DType::i32;
  face.shape = distance.shape = {points, 1};
  barycentric.shape = closest.shape = {points, 3};
  for (std::int64_t i = 0; i < live; ++i) {
    const Vector3d p(in[0].data[3 * i], in[0].data[3 * i + 1], in[0].data[3 * i + 2]);
    const NearestTriangle nearest = nearest_triangle(p, mesh.vertices, mesh.triangles);
    const bool found = nearest.distance < max_distance;
    face.data.push_back(found ? nearest.face : -1);
    const Vector3d point = found ? nearest.point : p;
    closest.data.insert(closest.data.end(), {point.x(), point.y(), point.z()});
    Vector3d weights = Vector3d::Zero();
    double side = 1;
    if (found) {
      const auto& t = mesh.triangles[nearest.face];
      Eigen::Matrix3d corners;
      corners << mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]];
      weights = corners.colPivHouseholderQr().solve(point);
      const Vector3d normal = (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0));
      side = normal.dot(p - point) < 0 ? -1 : 1;
    }
    barycentric.data.insert(barycentric.data.end(), {weights[0], weights[1], weights[2]});
    distance.data.push_back(found ? side * nearest.distance : max_distance);
  }
  return {face, barycentric, distance, closest};
}

// One level of the hierarchy, two, and three with a last node that is not full.
const Register registration(OpCase{
    .op = "closest_point",
    .variations = {{{0, 1, -1}, {{"max_distance", 0.5}}}, {{2, 41, -1}}, {{3, 37, 20}}, {{5, 33, -1}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{6, 65536, -1}},
    .bytes = [](const Variation& v) { return 4.0 * 11 * static_cast<double>(v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
