#include "vivant/data/camera.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <opencv2/calib3d.hpp>

#include "io_helpers.hpp"

using namespace vivant;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

Camera phone_camera() {
  Camera camera{.width = 270, .height = 480, .fx = 343.88, .fy = 343.6225, .cx = 138.6395, .cy = 241.317};
  camera.k1 = 0.0578421;
  camera.k2 = -0.0805099;
  camera.p1 = -0.000980296;
  camera.p2 = 0.00015575;
  camera.world_to_camera = look_at({1, 2, 3}, {0.2, 0.9, -0.4}, {0, 1, 0});
  return camera;
}

}  // namespace

TEST_CASE("camera: undistortion agrees with OpenCV at every pixel centre") {
  const Camera camera = phone_camera();
  std::vector<cv::Point2d> pixels, expected;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) pixels.emplace_back(column + 0.5, row + 0.5);
  }
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const cv::Vec4d distortion(camera.k1, camera.k2, camera.p1, camera.p2);
  cv::undistortPoints(pixels, expected, matrix, distortion, cv::noArray(), cv::noArray(),
                      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-14));
  const std::vector<Vector2d> points = undistorted_pixel_centres(camera);
  REQUIRE(points.size() == expected.size());
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    worst =
        std::max({worst, std::abs(points[i].x() - expected[i].x), std::abs(points[i].y() - expected[i].y)});
  }
  CHECK(worst < 1e-10);
}

TEST_CASE("camera: a point on a pixel's ray projects to that pixel") {
  const Camera camera = phone_camera();
  for (const Vector2d& pixel :
       {Vector2d(0.5, 0.5), Vector2d(269.5, 479.5), Vector2d(100.25, 7), Vector2d(3, 400)}) {
    const Ray ray = camera.ray(pixel);
    CHECK(ray.direction.norm() == doctest::Approx(1));
    const Vector3d projected = camera.project(ray.origin + 2.5 * ray.direction);
    CHECK((projected.head<2>() - pixel).norm() < 1e-9);
    CHECK(projected.z() == doctest::Approx(2.5 * ray.direction.dot(camera.forward())));
  }
  CHECK((camera.ray({camera.cx, camera.cy}).direction - camera.forward()).norm() < 1e-12);
}

TEST_CASE("camera: OpenGL camera-to-world converts both ways") {
  Matrix4d camera_to_world = Matrix4d::Identity();
  camera_to_world.topRightCorner<3, 1>() = Vector3d(0, 1, 5);
  Camera camera{.width = 100, .height = 100, .fx = 100, .fy = 100, .cx = 50, .cy = 50};
  camera.set_opengl_camera_to_world(camera_to_world);
  CHECK((camera.centre() - Vector3d(0, 1, 5)).norm() < 1e-15);
  CHECK((camera.forward() - Vector3d(0, 0, -1)).norm() < 1e-15);
  CHECK((camera.opengl_camera_to_world() - camera_to_world).norm() < 1e-15);
  // Up in the world is up in the image, right is right.
  const Vector3d above = camera.project({0.5, 2, 0});
  CHECK(above.x() == doctest::Approx(60));
  CHECK(above.y() == doctest::Approx(30));
  CHECK(above.z() == doctest::Approx(5));
}

TEST_CASE("camera: look_at, resized") {
  Camera camera = phone_camera();
  CHECK((camera.centre() - Vector3d(1, 2, 3)).norm() < 1e-12);
  CHECK(camera.world_to_camera.topLeftCorner<3, 3>().determinant() == doctest::Approx(1));
  const Vector3d target = camera.project({0.2, 0.9, -0.4});
  CHECK(target.x() == doctest::Approx(camera.cx));
  CHECK(target.y() == doctest::Approx(camera.cy));
  CHECK(camera.project({0.2, 1.4, -0.4}).y() < camera.cy);
  const Camera half = camera.resized(135, 240);
  const Vector3d point(0.3, 1.1, -0.2);
  CHECK((half.project(point).head<2>() - 0.5 * camera.project(point).head<2>()).norm() < 1e-9);
  CHECK(contains(error_of([&] { camera.resized(0, 10); }), "0x10"));
  CHECK(contains(error_of([] { look_at({0, 0, 0}, {0, 1, 0}, {0, 1, 0}); }), "up direction"));
}
