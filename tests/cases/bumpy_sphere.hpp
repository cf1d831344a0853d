#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <vector>

namespace vivant::cases {

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;  ///< counter-clockwise from outside
};

/// A closed mesh of 8 * 4^subdivisions triangles around the origin: a sphere of radius 1 with bumps and
/// hollows.
inline TriangleMesh bumpy_sphere(int subdivisions) {
  using Eigen::Vector3i;
  TriangleMesh mesh;
  mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (int octant = 0; octant < 8; ++octant) {
    const Vector3i corners(octant & 1, 2 + (octant >> 1 & 1), 4 + (octant >> 2 & 1));
    const bool flip = ((octant & 1) + (octant >> 1 & 1) + (octant >> 2 & 1)) % 2 == 1;
    mesh.triangles.push_back(flip ? Vector3i(corners[0], corners[2], corners[1]) : corners);
  }
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [entry, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.vertices.size()));
      if (fresh) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return entry->second;
    };
    std::vector<Vector3i> finer;
    for (const Vector3i& t : mesh.triangles) {
      const int ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  for (auto& p : mesh.vertices)
    p *= 1 + 0.2 * std::sin(3 * p.x() + 1) * std::cos(4 * p.y()) + 0.1 * std::sin(5 * p.z());
  return mesh;
}

/// Unit normals of the vertices: those of their triangles, weighted by the angles there.
inline std::vector<Eigen::Vector3d> angle_weighted_normals(std::span<const Eigen::Vector3d> vertices,
                                                           std::span<const Eigen::Vector3i> triangles) {
  std::vector<Eigen::Vector3d> normals(vertices.size(), Eigen::Vector3d::Zero());
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d next = vertices[t[(k + 1) % 3]] - vertices[t[k]],
                            before = vertices[t[(k + 2) % 3]] - vertices[t[k]];
      normals[t[k]] +=
          std::acos(next.normalized().dot(before.normalized())) * next.cross(before).normalized();
    }
  for (Eigen::Vector3d& normal : normals) normal.normalize();
  return normals;
}

/// The closest point of a triangle, from the definition: the foot on the plane when it lies inside, else the
/// closest of the three edges' closest points.
inline Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& query, const Eigen::Vector3d& a,
                                           const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const Eigen::Vector3d foot = query - normal * (normal.dot(query - a) / normal.squaredNorm());
  const auto left_of = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
    return (q - p).cross(foot - p).dot(normal) >= 0;
  };
  if (left_of(a, b) && left_of(b, c) && left_of(c, a)) return foot;
  Eigen::Vector3d best = a;
  const auto edge = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
    const double at = std::clamp((query - p).dot(q - p) / (q - p).squaredNorm(), 0.0, 1.0);
    const Eigen::Vector3d point = p + at * (q - p);
    if ((query - point).squaredNorm() < (query - best).squaredNorm()) best = point;
  };
  edge(a, b);
  edge(b, c);
  edge(c, a);
  return best;
}

struct NearestTriangle {
  int face = -1;
  Eigen::Vector3d point;
  double distance = std::numeric_limits<double>::infinity();
};

/// The closest of all triangles.
inline NearestTriangle nearest_triangle(const Eigen::Vector3d& query,
                                        std::span<const Eigen::Vector3d> vertices,
                                        std::span<const Eigen::Vector3i> triangles) {
  NearestTriangle best;
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto& t = triangles[f];
    const auto point = closest_on_triangle(query, vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    const double distance = (query - point).norm();
    if (distance < best.distance) best = {static_cast<int>(f), point, distance};
  }
  return best;
}

}  // namespace vivant::cases
