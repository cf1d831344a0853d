#include "vivant/jobs/placing.hpp"

#include <cmath>

#include "body_helpers.hpp"
#include "io_helpers.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

/// The chain of chain_body walks from the origin along +z, which it faces, its feet at height 0.
Motion walk() {
  Motion motion;
  motion.pose.assign(3, Pose(3, Vector3d::Zero()));
  motion.translation = {{0, 0, 0}, {0, 0, 1}, {0, 0, 2}};
  return motion;
}

/// Where the body's root is in a frame, and which way it faces and stands.
struct Stance {
  Vector3d root, forward, up;
};
Stance stance(const Motion& motion, int frame) {
  const Eigen::Matrix3d rotation = rotation_from_axis_angle(motion.pose[frame][0]);
  return {chain_body().joints[0] + motion.translation[frame], rotation.col(2), rotation.col(1)};
}

Capture looking(const Vector3d& forward, const Vector3d& up) {
  Capture capture;
  capture.frames.resize(1);
  capture.frames[0].camera.world_to_camera = look_at(Vector3d::Zero(), forward, up);
  return capture;
}

}  // namespace

TEST_CASE("placing: a place is four numbers, or five with the units in a metre") {
  CHECK(place_from("1,-2.5,3e1,90") == Place{{1, -2.5, 30}, 90, 1});
  CHECK(place_from("1,2,3,-4,0.25") == Place{{1, 2, 3}, -4, 0.25});
  for (const std::string wrong : {"", "1,2,3", "1,2,3,4,5,6", "1,2,,4", "1,2,3,x", "1,2,3,4 ", "1,2,3,4,0",
                                  "1,2,3,4,-1", "1,2,3,nan", "inf,2,3,4"}) {
    CAPTURE(wrong);
    CHECK_THROWS_AS(place_from(wrong), UsageError);
    CHECK(contains(error_of([&] { place_from(wrong); }), "a place is x,y,z,yaw"));
  }
}

TEST_CASE("placing: people stand along the world's axis when the cameras look a little down") {
  const double down = std::tan(15 * M_PI / 180), far_down = std::tan(30 * M_PI / 180);
  CHECK(standing_up(looking({1, 0, -down}, Vector3d::UnitZ())) == Vector3d::UnitZ());
  CHECK(standing_up(looking({1, down, 0}, -Vector3d::UnitY())) == -Vector3d::UnitY());
  const Vector3d tilted = standing_up(looking({1, 0, -far_down}, Vector3d::UnitZ()));
  CHECK(std::abs(tilted.dot(Vector3d::UnitZ()) - std::cos(30 * M_PI / 180)) < 1e-9);
}

TEST_CASE("placing: a motion stands at a place in worlds with other ups and units") {
  const auto near = [](const Vector3d& a, const Vector3d& b) { return (a - b).norm() < 1e-9; };
  const Motion upright = placed_in_scene(chain_body(), walk(), {{5, 1, -2}, 90, 1}, Vector3d::UnitY());
  CHECK(near(stance(upright, 0).root, {5, 1, -2}));
  CHECK(near(stance(upright, 2).root, {7, 1, -2}));
  CHECK(near(stance(upright, 0).forward, Vector3d::UnitX()));

  // z up, 2 units in a metre: (6, 4, 1) of the scene is (3, 2, 0.5) in metres. The walk faces -y.
  const Motion lying = placed_in_scene(chain_body(), walk(), {{6, 4, 1}, 0, 2}, Vector3d::UnitZ());
  CHECK(near(stance(lying, 0).root, {3, 2, 0.5}));
  CHECK(near(stance(lying, 2).root, {3, 0, 0.5}));
  CHECK(near(stance(lying, 0).forward, -Vector3d::UnitY()));
  CHECK(near(stance(lying, 1).up, Vector3d::UnitZ()));
  const Motion turned = placed_in_scene(chain_body(), walk(), {{6, 4, 1}, 90, 2}, Vector3d::UnitZ());
  CHECK(near(stance(turned, 2).root, {5, 2, 0.5}));
}
