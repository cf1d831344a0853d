#include "vivant/data/ground.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "body_helpers.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

/// A body of a small foot, whose lowest vertex is `foot` of each frame.
Motion walk_over(const std::vector<Vector3d>& feet) {
  Motion motion;
  for (const Vector3d& foot : feet) {
    motion.pose.push_back(Pose(3, Vector3d::Zero()));
    motion.translation.push_back(foot);
  }
  return motion;
}

Body thin_body() {
  Body body = chain_body();
  for (Vector3d& vertex : body.vertices) vertex.x() = vertex.z() = 0;
  return body;
}

/// A walk in a circle of this radius on y = -1 + 0.1 x - 0.05 z, every eighth frame of it a jump.
std::vector<Vector3d> circle(double radius) {
  std::vector<Vector3d> feet;
  for (int i = 0; i < 80; ++i) {
    const double x = radius * std::cos(0.2 * i), z = radius * std::sin(0.2 * i);
    feet.emplace_back(x, -1 + 0.1 * x - 0.05 * z + (i % 8 == 0 ? 0.4 : 0), z);
  }
  return feet;
}

}  // namespace

TEST_CASE("ground: a tilted floor is found below feet that walk on it, whatever jumps") {
  const std::vector<Vector3d> feet = circle(3);
  const auto ground = fitted_ground(thin_body(), walk_over(feet));
  REQUIRE(ground);
  CHECK(ground->normal.norm() == doctest::Approx(1));
  CHECK(std::abs(-ground->normal.x() / ground->normal.y() - 0.1) < 0.005);
  CHECK(std::abs(-ground->normal.z() / ground->normal.y() + 0.05) < 0.005);
  double lowest = 1;
  for (const Vector3d& foot : feet) lowest = std::min(lowest, ground->height_above(foot));
  CHECK(std::abs(lowest) < 1e-12);
  CHECK(ground->height_above({0, -1, 0}) < 0.03);
}

TEST_CASE("ground: who stays in one place says nothing of a slope, and no floor is as steep as a wall") {
  const auto level = fitted_ground(thin_body(), walk_over(circle(0.05)));
  REQUIRE(level);
  CHECK(level->normal.y() > 0.9999);
  std::vector<Vector3d> climbing;
  climbing.reserve(50);
  for (int i = 0; i < 50; ++i) climbing.emplace_back(0.1 * i, 0.06 * i, 0);
  CHECK_FALSE(fitted_ground(thin_body(), walk_over(climbing)));
}
