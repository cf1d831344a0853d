#include "vivant/data/body_silhouette.hpp"

#include "io_helpers.hpp"
#include "vivant/data/capture.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/jobs/silhouette_scores.hpp"
#include "vivant/jobs/synth.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

/// A camera before the resting body, which faces it.
Camera facing() {
  Camera camera;
  camera.width = 200;
  camera.height = 300;
  camera.fx = camera.fy = 450;
  camera.cx = 100;
  camera.cy = 150;
  camera.world_to_camera = look_at({0, 0.85, 3}, {0, 0.85, 0}, Vector3d::UnitY());
  return camera;
}

}  // namespace

TEST_CASE("body silhouette: it is the mask that synth draws of the same pose") {
  const TemporaryFolder folder;
  synthesise({.output = folder / "walk", .frames = 2, .width = 240, .height = 180, .motion = {}});
  for (const char* name : {"walk", "walk/truth/novel_poses"}) {
    const Capture capture = load_capture(folder / name);
    const Motion& poses = capture.human->poses;
    for (int i = 0; i < static_cast<int>(capture.frames.size()); ++i) {
      CAPTURE(capture.frames[i].name);
      const int row = capture.frames[i].body_frame;
      const BodySilhouette silhouette = posed_silhouette(capture.human->body, poses.pose[row],
                                                         poses.translation[row], capture.frames[i].camera);
      CHECK(silhouette_iou(silhouette.mask, capture.mask(i)) > 0.97);
    }
  }
}

TEST_CASE("body silhouette: every limb is seen where its bone is, and only there") {
  const Body body = load_body(asset_path("body.safetensors"));
  const Camera camera = facing();
  const BodySilhouette silhouette = body_silhouette(body, body.vertices, camera);
  const auto limb_at = [&](const Vector3d& point) {
    const Vector3d pixel = camera.project(point);
    return silhouette.limb.at<int>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
  };
  for (std::size_t i = 0; i < limbs.size(); ++i) {
    CAPTURE(limbs[i].name);
    const int joint = body.find_joint(limbs[i].joints[0]);
    REQUIRE(joint >= 0);
    CHECK(limb_at(0.5 * (body.joints[joint] + body.tails[joint])) == static_cast<int>(i));
  }
  CHECK(limb_at(body.joints[body.find_joint("Spine1")]) == -1);
  CHECK(limb_at({1, 0.85, 0}) == -1);
  CHECK(cv::countNonZero((silhouette.limb >= 0) & ~silhouette.mask) == 0);

  // Of two limbs in line the nearer one is seen.
  Camera from_left = camera;
  from_left.world_to_camera = look_at({3, 0.85, 0}, {0, 0.85, 0}, Vector3d::UnitY());
  const cv::Mat limb = body_silhouette(body, body.vertices, from_left).limb;
  CHECK(cv::countNonZero(limb == 5) > 5 * cv::countNonZero(limb == 11));  // lower legs
}
