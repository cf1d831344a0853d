#include "vivant/jobs/flow.hpp"

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>

#include "graph_helpers.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/image.hpp"
#include "vivant/model/scene_model.hpp"

using namespace vivant;

namespace {

Camera camera_at(double x) {
  Camera camera{.width = 64, .height = 48, .fx = 60, .fy = 60, .cx = 32, .cy = 24};
  camera.world_to_camera(0, 3) = -x;
  return camera;
}

/// The depth along the rays of a wall `distance` in front of the camera.
cv::Mat wall(const Camera& camera, double distance) {
  cv::Mat depth(camera.height, camera.width, CV_32FC1);
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      depth.at<float>(y, x) =
          static_cast<float>(distance / camera.forward().dot(camera.ray({x + 0.5, y + 0.5}).direction));
  return depth;
}

/// The depth that a scene model renders of that wall, with fog between it and the camera that takes two
/// thirds of the light.
cv::Mat wall_in_fog(const Camera& camera, double distance) {
  constexpr int sample_count = 96;
  ParameterStore store;
  const SceneModel scene(test_device(), store, Initializer(3),
                         {.encoding = Encoding::vanilla, .plane_size = 16, .channels = 16},
                         {.bounded = false, .near = 0.5, .far = 6, .opaque_last = false}, sample_count);
  store.allocate(test_device());
  const std::int64_t count = static_cast<std::int64_t>(camera.width) * camera.height;
  std::vector<double> origins, directions;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Ray ray = camera.ray({x + 0.5, y + 0.5});
      origins.insert(origins.end(), ray.origin.begin(), ray.origin.end());
      directions.insert(directions.end(), ray.direction.begin(), ray.direction.end());
    }
  Graph graph;
  const Rays rays{graph.constant({count, 3}, origins), graph.constant({count, 3}, directions)};
  FieldSamples samples = scene.sample(graph, scene.field().planes(graph), rays, nullptr);
  samples.density = graph.input("density", {count, sample_count});
  const RenderedRays seen = scene.render(graph, samples);
  Run run(graph, {samples.depths, seen.depth});
  run.write(samples.density, std::vector<float>(count * sample_count));
  std::vector<float> density = run.read(samples.depths);
  const cv::Mat surface = wall(camera, distance);
  for (int i = 0; i < static_cast<int>(density.size()); ++i)
    density[i] = density[i] < surface.at<float>(i / sample_count) ? 0.44f : 1000.0f;
  run.write(samples.density, density);
  return cv::Mat(run.read(seen.depth), true).reshape(1, camera.height);
}

}  // namespace

TEST_CASE("flow: a wall seen by a camera that moves sideways moves by focal length over distance") {
  const SurfaceView from{camera_at(0), wall(camera_at(0), 3), {}},
      to{camera_at(0.15), wall(camera_at(0.15), 3), {}};
  const SurfaceFlow surface(nullptr, 1);
  const cv::Mat forward = surface.flow(from, to), backward = surface.flow(to, from);
  CHECK(cv::norm(forward.at<cv::Vec2f>(20, 30) - cv::Vec2f(-3, 0)) < 1e-4);
  const cv::Mat visible = visible_pixels(forward, backward);
  CHECK(cv::countNonZero(visible.colRange(3, 64)) == 61 * 48);
  CHECK(cv::countNonZero(visible.colRange(0, 3)) == 0);  // they leave the picture

  cv::Mat first, second, painted;
  cv::resize(read_image(asset_path("styles/cubist.jpg")), painted, {67, 48}, 0, 0, cv::INTER_AREA);
  first = painted.colRange(0, 64).clone();
  second = painted.colRange(3, 67).clone();
  CHECK(cv::norm(warped(second, forward).colRange(3, 64), first.colRange(3, 64), cv::NORM_INF) <= 1);
  // A backward flow that says otherwise hides the pixels.
  CHECK(cv::countNonZero(visible_pixels(forward, cv::Mat(backward + cv::Scalar(2, 0)))) == 0);
  // Where the depth is unknown nothing is visible.
  SurfaceView blind = from;
  blind.depth = cv::Mat::zeros(48, 64, CV_32FC1);
  CHECK(cv::countNonZero(visible_pixels(surface.flow(blind, to), backward)) == 0);
}

TEST_CASE("flow: a wall moves as fast behind fog") {
  const SurfaceView from{camera_at(0), wall_in_fog(camera_at(0), 3), {}},
      to{camera_at(0.15), wall_in_fog(camera_at(0.15), 3), {}};
  const cv::Mat forward = SurfaceFlow(nullptr, 1).flow(from, to);
  double worst = 0;
  for (int y = 0; y < forward.rows; ++y)
    for (int x = 0; x < forward.cols; ++x)
      worst = std::max(worst, cv::norm(forward.at<cv::Vec2f>(y, x) - cv::Vec2f(-3, 0)));
  CHECK(worst < 0.1);  // the interval of a sample; mean and median depth say pixels more
}

TEST_CASE("flow: the person moves with the body, the wall behind stands still") {
  const Body body = load_body(asset_path("body.safetensors"));
  const Pose rest(body.joints.size(), Eigen::Vector3d::Zero());
  // The body stands two units in front of the camera: one unit is half a metre.
  Camera camera{.width = 64, .height = 48, .fx = 20, .fy = 20, .cx = 32, .cy = 24};
  camera.world_to_camera << 1, 0, 0, 0, 0, -1, 0, 2, 0, 0, -1, 4, 0, 0, 0,
      1;  // at (0, 2, 4), looking along -z
  SurfaceView from{camera, wall(camera, 4), cv::Mat::zeros(48, 64, CV_32FC1),
                   joint_transforms(body, rest, {0, 0, 0})},
      to = from;
  to.joints = joint_transforms(body, rest, {0.2, 0, 0});
  from.person(cv::Rect(28, 20, 8, 10)).setTo(1);
  const cv::Mat flow = SurfaceFlow(&body, 2).flow(from, to);
  CHECK(cv::norm(flow.at<cv::Vec2f>(24, 31) - cv::Vec2f(20 * 0.4f / 4, 0)) < 1e-3);
  CHECK(cv::norm(flow.at<cv::Vec2f>(24, 5)) < 1e-4);
}

TEST_CASE("flow: DIS follows a picture that is shifted") {
  cv::Mat painted;
  cv::resize(read_image(asset_path("styles/cubist.jpg")), painted, {132, 96}, 0, 0, cv::INTER_AREA);
  const cv::Mat flow = dis_flow(painted.colRange(0, 128), painted.colRange(4, 132));
  const cv::Scalar mean = cv::mean(flow(cv::Rect(16, 16, 96, 64)));
  CHECK(mean[0] == doctest::Approx(-4).epsilon(0.05));
  CHECK(std::abs(mean[1]) < 0.2);
}

TEST_CASE("flow: points of the person at rest are those of the body at rest") {
  // One bone that moves everything by one metre, and turns it.
  Body body;
  body.vertices = {{0, 0, 3}, {0.4, 0, 3}, {0, 0.4, 3}};
  body.influences = 1;
  body.skin_joints = {0, 0, 0};
  body.skin_weights = {1, 1, 1};
  RigidTransform moved = RigidTransform::Zero();
  moved.leftCols<3>() = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  moved.col(3) = Eigen::Vector3d(0.2, -0.1, 0);
  SurfaceView view{camera_at(0), wall(camera_at(0), 6), {}};
  view.person = cv::Mat(48, 64, CV_32FC1, cv::Scalar(1));
  view.person.colRange(0, 32).setTo(0);
  view.joints = {moved};
  const double units_per_metre = 2;  // the wall z = 6 is 3 metres away
  const cv::Mat points = SurfaceFlow(&body, units_per_metre).rest_points(view),
                scene = SurfaceFlow(nullptr, units_per_metre).rest_points(view);
  CHECK(cv::norm(points.colRange(0, 32), scene.colRange(0, 32), cv::NORM_INF) == 0);
  const Eigen::Vector3d apart(SurfaceFlow::rest_apart, 0, 0);
  for (const int x : {33, 50}) {
    const cv::Vec3f &at = points.at<cv::Vec3f>(20, x), &from = scene.at<cv::Vec3f>(20, x);
    const Eigen::Vector3d again =
        moved * (Eigen::Vector3d(at[0], at[1], at[2]) / units_per_metre - apart).homogeneous() *
        units_per_metre;
    CHECK((again - Eigen::Vector3d(from[0], from[1], from[2])).norm() < 1e-4);
  }
}
