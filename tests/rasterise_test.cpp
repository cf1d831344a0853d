#include "vivant/data/rasterise.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>

using namespace vivant;
using Eigen::Vector3d;
using Eigen::Vector3i;

TEST_CASE("rasterise: the nearest triangle is kept with its exact depth, in any order") {
  Camera camera;
  camera.width = 24;
  camera.height = 18;
  camera.fx = camera.fy = 20;
  camera.cx = 12;
  camera.cy = 9;
  // Two triangles of one outline, so that each hides the other somewhere, and one that reaches behind the
  // camera.
  const std::vector<Vector3d> vertices = {{-1.2, -1.2, 3}, {3.2, -3.2, 8}, {0, 2, 5},
                                          {-2, -2, 5},     {2, -2, 5},     {0, 2, 5},
                                          {-1, -1, -1},    {1, -1, 2},     {0, 1, 2}};
  const Vector3i tilted(0, 1, 2), flat(3, 4, 5), behind(6, 7, 8);
  const std::vector<Vector3i> orders[] = {{tilted, flat, behind}, {behind, flat, tilted}};
  const Eigen::Hyperplane<double, 3> plane =
      Eigen::Hyperplane<double, 3>::Through(vertices[0], vertices[1], vertices[2]);
  int tilted_seen = 0, flat_seen = 0;
  for (const std::vector<Vector3i>& triangles : orders) {
    const Visibility seen = rasterise(camera, vertices, triangles);
    for (int row = 0; row < camera.height; ++row) {
      for (int column = 0; column < camera.width; ++column) {
        const int at = row * camera.width + column;
        if (seen.triangle[at] < 0) continue;
        const Vector3d direction((column + 0.5 - camera.cx) / camera.fx, (row + 0.5 - camera.cy) / camera.fy,
                                 1);
        const double depth = -plane.offset() / plane.normal().dot(direction);
        const bool is_tilted = triangles[seen.triangle[at]] == tilted;
        CHECK(triangles[seen.triangle[at]] != behind);
        if (std::abs(depth - 5) > 1e-3) CHECK(is_tilted == (depth < 5));
        CHECK(1 / seen.inverse_depth[at] == doctest::Approx(is_tilted ? depth : 5).epsilon(1e-5));
        (is_tilted ? tilted_seen : flat_seen) += 1;
      }
    }
  }
  CHECK(tilted_seen > 20);
  CHECK(flat_seen > 20);
}

TEST_CASE("rasterise: what a strong distortion folds back into the picture is not seen") {
  Camera camera;
  camera.width = 24;
  camera.height = 18;
  camera.fx = camera.fy = 20;
  camera.cx = 12;
  camera.cy = 9;
  camera.k1 = -0.3;  // grows outwards up to x/z = 1.05 alone
  const std::vector<Vector3d> vertices = {{-0.5, -0.5, 5}, {0.5, -0.5, 5}, {0, 0.5, 5},
                                          {7, -0.5, 5},    {8, -0.5, 5},   {7.5, 1, 5}};
  REQUIRE(camera.project(vertices[5]).x() < camera.width);
  const Visibility seen = rasterise(camera, vertices, std::vector<Vector3i>{{0, 1, 2}, {3, 4, 5}});
  CHECK(std::ranges::count(seen.triangle, 0) > 5);
  CHECK(std::ranges::count(seen.triangle, 1) == 0);
}
