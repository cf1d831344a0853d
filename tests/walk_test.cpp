#include "vivant/data/walk.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "vivant/io/assets.hpp"
#include "vivant/runtime/error.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

std::vector<Vector3d> posed(const Body& body, const Motion& motion, int frame) {
  return posed_vertices(body, motion, frame);
}

double lowest(const std::vector<Vector3d>& vertices) {
  double y = vertices.front().y();
  for (const Vector3d& vertex : vertices) y = std::min(y, vertex.y());
  return y;
}

}  // namespace

TEST_CASE("the procedural walk advances over the ground without sliding") {
  const Body body = load_body(asset_path("body.safetensors"));
  WalkOptions options;
  options.start_heading = options.end_heading = 0;
  options.frames = 45;
  const Motion walk = procedural_walk(body, options);
  REQUIRE(walk.frame_count() == options.frames);
  check_motion(walk, body.joint_count(), "walk");

  const Vector3d travelled = walk.translation.back() - walk.translation.front();
  CHECK(travelled.z() / ((options.frames - 1) / options.fps) > 0.8);  // metres a second, along the heading
  CHECK(travelled.z() / ((options.frames - 1) / options.fps) < 1.8);
  CHECK(std::abs(travelled.x()) < 0.05);

  std::vector<Vector3d> before = posed(body, walk, 0);
  for (int frame = 1; frame < walk.frame_count(); ++frame) {
    const std::vector<Vector3d> after = posed(body, walk, frame);
    CHECK(std::abs(lowest(after)) < 0.008);
    // Vertices that stay within 3 mm of the ground for a frame belong to a planted foot.
    for (std::size_t v = 0; v < after.size(); ++v) {
      if (before[v].y() > 0.003 || after[v].y() > 0.003) continue;
      CHECK(std::hypot(after[v].x() - before[v].x(), after[v].z() - before[v].z()) < 0.008);
    }
    before = after;
  }
}

TEST_CASE("a walk follows its headings and both legs alternate") {
  const Body body = load_body(asset_path("body.safetensors"));
  WalkOptions options;
  options.start_heading = -30;
  options.end_heading = 60;
  const Motion walk = procedural_walk(body, options);
  CHECK(heading(walk.pose.front()[0]) == doctest::Approx(-30).epsilon(0.25));
  CHECK(heading(walk.pose.back()[0]) == doctest::Approx(60).epsilon(0.15));
  const int left = body.find_joint("LeftLeg"), right = body.find_joint("RightLeg");
  bool left_bent_more = false, right_bent_more = false;
  for (const Pose& pose : walk.pose) {
    left_bent_more |= pose[left].x() > pose[right].x() + 0.5;
    right_bent_more |= pose[right].x() > pose[left].x() + 0.5;
  }
  CHECK(left_bent_more);
  CHECK(right_bent_more);
}

TEST_CASE("a dance goes smoothly from posture to posture, on the floor") {
  const Body body = load_body(asset_path("body.safetensors"));
  const Motion postures = posture_collection(body), dance = procedural_dance(body, 20, 8);
  CHECK(dance.fps == 20);
  REQUIRE(dance.frame_count() == 64);
  double fastest = 0;
  for (int frame = 0; frame < dance.frame_count(); ++frame) {
    CHECK(lowest(posed(body, dance, frame)) == doctest::Approx(0).epsilon(1e-9));
    const Pose &pose = dance.pose[frame], &next = dance.pose[(frame + 1) % dance.frame_count()];
    for (int joint = 0; joint < body.joint_count(); ++joint) {
      if (frame % 8 == 0) CHECK((pose[joint] - postures.pose[frame / 8][joint]).norm() < 1e-9);
      const Eigen::Matrix3d turn =
          rotation_from_axis_angle(pose[joint]).transpose() * rotation_from_axis_angle(next[joint]);
      fastest = std::max(fastest, axis_angle_from_rotation(turn).norm());
    }
  }
  CHECK(fastest < 0.6);  // a radian takes more than one frame
}

TEST_CASE("postures stand on the ground and need the rig's joints") {
  Body body = load_body(asset_path("body.safetensors"));
  const Motion postures = posture_collection(body);
  CHECK(postures.frame_count() == 8);
  for (int i = 0; i < postures.frame_count(); ++i) {
    CHECK(lowest(posed(body, postures, i)) == doctest::Approx(0).epsilon(1e-9));
  }
  body.joint_names[body.find_joint("LeftForeArm")] = "elbow";
  CHECK_THROWS_WITH_AS(posture_collection(body), doctest::Contains("LeftForeArm"), Error);
}
