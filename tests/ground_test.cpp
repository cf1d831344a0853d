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

/// Places on a circle of this radius on y = -1 + 0.1 x - 0.05 z, every eighth of them in a jump.
std::vector<Vector3d> circle(double radius, int frames = 80) {
  std::vector<Vector3d> feet;
  feet.reserve(frames);
  for (int i = 0; i < frames; ++i) {
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
  CHECK(std::abs(ground->height_above({0, -1, 0})) < 0.03);
  // Two frames of a bad fit, a metre too deep, move it by little; the other feet are above it.
  std::vector<Vector3d> bad = feet;
  bad[3].y() -= 1;
  bad[42].y() -= 1;
  const auto same = fitted_ground(thin_body(), walk_over(bad));
  REQUIRE(same);
  CHECK((same->normal - ground->normal).norm() < 0.01);
  CHECK(std::abs(same->height_above({0, -1, 0})) < 0.03);
  const auto sunk = std::count_if(bad.begin(), bad.end(),
                                  [&](const Vector3d& foot) { return same->height_above(foot) < -1e-9; });
  CHECK(sunk >= 2);
  CHECK(sunk <= 4);
}

TEST_CASE("ground: who stays in one place says nothing of a slope, and no floor is as steep as a wall") {
  for (const int frames : {80, 2000}) {
    const auto level = fitted_ground(thin_body(), walk_over(circle(0.05, frames)));
    REQUIRE(level);
    CHECK(level->normal.y() > 0.9999);
  }
  std::vector<Vector3d> climbing;
  climbing.reserve(50);
  for (int i = 0; i < 50; ++i) climbing.emplace_back(0.1 * i, 0.06 * i, 0);
  CHECK_FALSE(fitted_ground(thin_body(), walk_over(climbing)));
}
