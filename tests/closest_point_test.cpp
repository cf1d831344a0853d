#include "vivant/ops/closest_point.hpp"

#include <cmath>
#include <random>

#include "body_helpers.hpp"
#include "cases/bumpy_sphere.hpp"
#include "io_helpers.hpp"
#include "vivant/data/inside_mesh.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/io/assets.hpp"

using namespace vivant;
using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

struct Found {
  std::vector<std::int32_t> face;
  std::vector<double> weights, distance;
};

std::vector<double> flat(const std::vector<Vector3d>& points) {
  return {points[0].data(), points[0].data() + 3 * points.size()};
}

Found find(Device& device, const std::vector<Vector3d>& vertices, const std::vector<Vector3i>& triangles,
           const std::vector<Vector3d>& queries, double max_distance) {
  Graph graph;
  const Value points = graph.input("points", {static_cast<std::int64_t>(queries.size()), 3});
  const Value corners = graph.input("vertices", {static_cast<std::int64_t>(vertices.size()), 3});
  const MeshIndex index = mesh_index(graph, mesh_topology(vertices, triangles));
  const ClosestPoint closest = closest_point(points, refit_mesh(corners, index), max_distance);
  Executor executor(device, graph, {closest.face, closest.barycentric, closest.signed_distance});
  executor.write(points, std::span<const double>(flat(queries)));
  executor.write(corners, std::span<const double>(flat(vertices)));
  executor.run();
  return {executor.read_ints(closest.face), executor.read_doubles(closest.barycentric),
          executor.read_doubles(closest.signed_distance)};
}

/// An L-shaped solid, leaning, so that its edges are sharp and blunt, convex and hollow.
cases::TriangleMesh steps() {
  const std::vector<std::pair<double, double>> outline = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
  cases::TriangleMesh mesh;
  for (double z : {0.0, 1.0})
    for (const auto& [x, y] : outline) mesh.vertices.emplace_back(x + 1.5 * z, y + z, z);
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {0, 5, 3},  {3, 5, 4},
                    {6, 7, 8}, {6, 8, 9}, {6, 9, 11}, {9, 10, 11}};
  for (int i = 0; i < 6; ++i) {
    const int j = (i + 1) % 6;
    mesh.triangles.insert(mesh.triangles.end(), {{i, j, j + 6}, {i, j + 6, i + 6}});
  }
  return mesh;
}

/// A thin tetrahedron one of whose faces is cut into a fan of slivers, which must not pull its corner's
/// normal.
cases::TriangleMesh spike() {
  constexpr int slivers = 12;
  cases::TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0.3}, {0.2, 1, 0.1}, {0.3, 0.2, 0.6}};
  mesh.triangles = {{0, 3, 2}, {0, 1, 3}};
  int before = 1;
  for (int i = 1; i <= slivers; ++i) {
    const double at = static_cast<double>(i) / slivers;
    const int next = i == slivers ? 2 : static_cast<int>(mesh.vertices.size());
    if (i < slivers) mesh.vertices.push_back((1 - at) * mesh.vertices[1] + at * mesh.vertices[2]);
    mesh.triangles.insert(mesh.triangles.end(), {{0, next, before}, {3, before, next}});
    before = next;
  }
  return mesh;
}

}  // namespace

TEST_CASE("closest_point: the sign is right around edges and corners, convex and hollow") {
  Device device;
  for (const cases::TriangleMesh& mesh : {steps(), spike(), cases::bumpy_sphere(2)}) {
    const InsideMesh inside(mesh.vertices, mesh.triangles);
    std::vector<Vector3d> queries;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> offset(-0.07, 0.07);
    const auto around = [&](const Vector3d& centre) {
      for (int i = 0; i < 40; ++i)
        queries.push_back(centre + Vector3d(offset(random), offset(random), offset(random)));
    };
    for (const Vector3d& vertex : mesh.vertices) around(vertex);
    for (const Vector3i& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) around(0.5 * (mesh.vertices[t[k]] + mesh.vertices[t[(k + 1) % 3]]));
    const Found found = find(device, mesh.vertices, mesh.triangles, queries, 1);
    double worst = 0;
    int wrong_side = 0;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const double distance = cases::nearest_triangle(queries[i], mesh.vertices, mesh.triangles).distance;
      worst = std::max(worst, std::abs(std::abs(found.distance[i]) - distance));
      wrong_side += distance > 1e-6 && inside.contains(queries[i]) != (found.distance[i] < 0);
    }
    CHECK(worst < 1e-6);
    CHECK(wrong_side == 0);
  }
}

TEST_CASE("closest_point: agrees with brute force on the real body") {
  const Body body = load_body(asset_path("body.safetensors"));
  const auto vertices = skin(body, joint_transforms(body, canonical_pose(body), Vector3d(0.4, 0.1, -7)));
  const InsideMesh inside(vertices, body.triangles);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> offset(-0.1, 0.1);
  std::vector<Vector3d> queries;
  for (int i = 0; i < 400; ++i)
    queries.push_back(vertices[random() % vertices.size()] +
                      (i % 2 == 0 ? 1.0 : 0.1) * Vector3d(offset(random), offset(random), offset(random)));
  Device device;
  const double max_distance = 0.08;
  const Found found = find(device, vertices, body.triangles, queries, max_distance);
  double worst = 0;
  int wrong_side = 0, far = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const double expected = cases::nearest_triangle(queries[i], vertices, body.triangles).distance;
    if (found.face[i] < 0) {
      CHECK(expected > max_distance - 1e-6);
      ++far;
      continue;
    }
    Vector3d point = Vector3d::Zero();
    for (int k = 0; k < 3; ++k)
      point += found.weights[3 * i + k] * vertices[body.triangles[found.face[i]][k]];
    worst = std::max({worst, std::abs(std::abs(found.distance[i]) - expected),
                      std::abs((queries[i] - point).norm() - expected)});
    wrong_side += expected > 1e-5 && inside.contains(queries[i]) != (found.distance[i] < 0);
  }
  MESSAGE("largest error: ", worst, " m; beyond the maximum distance: ", far);
  CHECK(worst < 3e-6);  // coordinates of 7 m have a rounding error of 5e-7 m
  CHECK(wrong_side == 0);
  CHECK(far > 0);
}
