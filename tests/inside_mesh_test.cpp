#include "vivant/data/inside_mesh.hpp"

#include <Eigen/Geometry>
#include <random>

#include "body_helpers.hpp"
#include "io_helpers.hpp"

using namespace vivant;
using Eigen::Vector3d;

TEST_CASE("inside mesh: a box, on a grid that meets its edges and diagonals") {
  const Body body = chain_body();
  const InsideMesh mesh(body.vertices, body.triangles);
  for (int x = -5; x <= 5; ++x) {
    for (int z = -5; z <= 5; ++z) {
      for (double y : {-0.5, 0.1, 1.5, 2.9, 3.5}) {
        const Vector3d point(0.0625 * x, y, 0.0625 * z + 0.01);
        const bool on_side = std::abs(x) == 4;
        if (on_side) continue;
        const bool inside = std::abs(point.x()) < 0.25 && std::abs(point.z()) < 0.25 && y > 0 && y < 3;
        CHECK(mesh.winding(point) == (inside ? 1 : 0));
      }
    }
  }
}

TEST_CASE("inside mesh: the real body against the solid angle") {
  const auto path = shared_data("body/body.safetensors");
  if (path.empty()) return;
  const Body body = load_body(path);
  // Legs that cross and arms against the trunk: parts overlap.
  Pose pose = canonical_pose(body, {.leg_angle = -0.25, .arm_angle = -0.8});
  const auto vertices = skin(body, joint_transforms(body, pose, Vector3d::Zero()));
  const InsideMesh mesh(vertices, body.triangles);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(-0.35, 0.35), y(0, 1.7), z(-0.1, 0.15);
  int inside = 0, overlaps = 0;
  for (int i = 0; i < 600; ++i) {
    const Vector3d point(x(random), y(random), z(random));
    // Generalised winding number: the solid angles of all triangles over 4 pi.
    double angle = 0;
    for (const auto& t : body.triangles) {
      const Vector3d a = vertices[t[0]] - point, b = vertices[t[1]] - point, c = vertices[t[2]] - point;
      const double na = a.norm(), nb = b.norm(), nc = c.norm();
      angle +=
          2 * std::atan2(a.dot(b.cross(c)), na * nb * nc + a.dot(b) * nc + b.dot(c) * na + c.dot(a) * nb);
    }
    const int winding = static_cast<int>(std::lround(angle / (4 * M_PI)));
    CHECK(mesh.winding(point) == winding);
    inside += winding > 0;
    overlaps += winding > 1;
  }
  CHECK(inside > 40);
  CHECK(overlaps > 0);
  MESSAGE("points inside: ", inside, ", in overlapping parts: ", overlaps);
}
