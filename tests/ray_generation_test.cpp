#include <doctest/doctest.h>

#include <opencv2/calib3d.hpp>

#include "vivant/data/camera_table.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/ops/rays.hpp"

using namespace vivant;

namespace {

std::vector<Camera> two_cameras() {
  std::vector<Camera> cameras(2);
  for (Camera& camera : cameras) {
    camera.width = 64;
    camera.height = 36;
    camera.fx = 60;
    camera.fy = 61;
    camera.cx = 31;
    camera.cy = 18.5;
  }
  cameras[0].world_to_camera = look_at({1, 2, 3}, {0, 0.5, 0}, {0, 1, 0});
  cameras[1].world_to_camera = look_at({-2, 1, 4}, {0, 0, 0}, {0, 1, 0});
  cameras[1].k1 = -0.21;
  cameras[1].k2 = 0.06;
  cameras[1].p1 = 0.004;
  cameras[1].p2 = -0.003;
  return cameras;
}

}  // namespace

TEST_CASE("ray_generation agrees with the camera and with OpenCV's undistortion") {
  const std::vector<Camera> cameras = two_cameras();
  const std::vector<float> table = camera_table(cameras);
  const int width = cameras[0].width, height = cameras[0].height, pixels = width * height;
  std::vector<std::int32_t> ids(2 * pixels);
  for (int i = 0; i < 2 * pixels; ++i) ids[i] = i;
  Graph graph;
  const Value cameras_in = graph.constant({2, camera_table_columns}, std::span<const float>(table));
  const Value pixels_in = graph.constant({2 * pixels}, std::span<const std::int32_t>(ids));
  const Rays rays = ray_generation(cameras_in, pixels_in, width, height);
  Device device;
  Executor executor(device, graph, {rays.origins, rays.directions});
  executor.run();
  const std::vector<float> origins = executor.read(rays.origins), directions = executor.read(rays.directions);
  double from_camera = 0, from_opencv = 0;
  for (int i = 0; i < 2 * pixels; ++i) {
    const Camera& camera = cameras[i / pixels];
    const Eigen::Vector2d place(i % width + 0.5, i / width % height + 0.5);
    const Ray ray = camera.ray(place);
    const Eigen::Vector3d direction(directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]);
    const Eigen::Vector3d origin(origins[3 * i], origins[3 * i + 1], origins[3 * i + 2]);
    from_camera = std::max({from_camera, (direction - ray.direction).norm(), (origin - ray.origin).norm()});

    std::vector<cv::Point2d> undistorted;
    const cv::Matx33d intrinsics(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
    const cv::Vec4d lens(camera.k1, camera.k2, camera.p1, camera.p2);
    cv::undistortPoints(std::vector<cv::Point2d>{{place.x(), place.y()}}, undistorted, intrinsics, lens,
                        cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12));
    const Eigen::Vector3d seen = camera.world_to_camera.topLeftCorner<3, 3>() * direction;
    from_opencv = std::max({from_opencv, std::abs(seen.x() / seen.z() - undistorted[0].x),
                            std::abs(seen.y() / seen.z() - undistorted[0].y)});
  }
  CHECK(from_camera < 1e-6);
  CHECK(from_opencv < 1e-5);
}

TEST_CASE("camera_table refuses cameras of different sizes") {
  std::vector<Camera> cameras = two_cameras();
  cameras[1].width = 65;
  CHECK_THROWS_WITH_AS(camera_table(cameras),
                       "[camera_table] a camera has images of 65x36 pixels, the first of 64x36", Error);
}
