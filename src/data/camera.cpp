#include "vivant/data/camera.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// OpenCV's distortion of normalised coordinates: radial 1 + k1 r^2 + k2 r^4 and the tangential terms of p1
/// and p2.
Vector2d distorted(const Camera& camera, const Vector2d& point) {
  const double x = point.x(), y = point.y(), r2 = point.squaredNorm();
  const double radial = 1 + r2 * (camera.k1 + r2 * camera.k2);
  return {x * radial + 2 * camera.p1 * x * y + camera.p2 * (r2 + 2 * x * x),
          y * radial + camera.p1 * (r2 + 2 * y * y) + 2 * camera.p2 * x * y};
}

Matrix2d distortion_jacobian(const Camera& camera, const Vector2d& point) {
  const double x = point.x(), y = point.y(), r2 = point.squaredNorm();
  const double radial = 1 + r2 * (camera.k1 + r2 * camera.k2);
  const double slope = 2 * (camera.k1 + 2 * camera.k2 * r2);  // d radial / d x = slope x
  const double cross = slope * x * y + 2 * camera.p1 * x + 2 * camera.p2 * y;
  Matrix2d jacobian;
  jacobian << radial + slope * x * x + 2 * camera.p1 * y + 6 * camera.p2 * x, cross, cross,
      radial + slope * y * y + 6 * camera.p1 * y + 2 * camera.p2 * x;
  return jacobian;
}

/// The rigid inverse [R^T | -R^T t], exact where a general inverse is not.
Matrix4d rigid_inverse(const Matrix4d& transform) {
  Matrix4d inverse = Matrix4d::Identity();
  const Matrix3d rotation = transform.topLeftCorner<3, 3>().transpose();
  inverse.topLeftCorner<3, 3>() = rotation;
  inverse.topRightCorner<3, 1>() = -rotation * transform.topRightCorner<3, 1>();
  return inverse;
}

}  // namespace

Vector3d Camera::centre() const {
  return -world_to_camera.topLeftCorner<3, 3>().transpose() * world_to_camera.topRightCorner<3, 1>();
}

Vector3d Camera::forward() const { return world_to_camera.row(2).head<3>().transpose(); }

Vector2d Camera::undistort(const Vector2d& pixel) const {
  const Vector2d target((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!distorted()) return target;
  // Newton's method; the distortion is close to the identity inside the image, so a few steps reach rounding.
  Vector2d point = target;
  for (int i = 0; i < 20; ++i) {
    const Vector2d error = vivant::distorted(*this, point) - target;
    const Matrix2d jacobian = distortion_jacobian(*this, point);
    if (jacobian.determinant() <= 1e-6)
      break;  // beyond the fold of the polynomial: keep the best point so far
    const Vector2d step = jacobian.inverse() * error;
    point -= step;
    if (step.squaredNorm() < 1e-26) break;
  }
  return point;
}

Vector2d Camera::distort(const Vector2d& normalised) const {
  const Vector2d point = distorted() ? vivant::distorted(*this, normalised) : normalised;
  return {point.x() * fx + cx, point.y() * fy + cy};
}

Ray Camera::ray(const Vector2d& pixel) const {
  const Vector2d point = undistort(pixel);
  const Vector3d direction =
      world_to_camera.topLeftCorner<3, 3>().transpose() * Vector3d(point.x(), point.y(), 1);
  return {centre(), direction.normalized()};
}

Vector3d Camera::project(const Vector3d& world) const {
  const Vector3d point =
      world_to_camera.topLeftCorner<3, 3>() * world + world_to_camera.topRightCorner<3, 1>();
  const Vector2d pixel = distort({point.x() / point.z(), point.y() / point.z()});
  return {pixel.x(), pixel.y(), point.z()};
}

Camera Camera::resized(int new_width, int new_height) const {
  if (new_width <= 0 || new_height <= 0)
    fail("an image of {}x{} pixels is not possible", new_width, new_height);
  Camera camera = *this;
  const double sx = static_cast<double>(new_width) / width, sy = static_cast<double>(new_height) / height;
  camera.width = new_width;
  camera.height = new_height;
  camera.fx *= sx;
  camera.cx *= sx;
  camera.fy *= sy;
  camera.cy *= sy;
  return camera;
}

Matrix4d Camera::opengl_camera_to_world() const {
  Matrix4d camera_to_world = rigid_inverse(world_to_camera);
  camera_to_world.block<3, 2>(0, 1) *= -1;
  return camera_to_world;
}

void Camera::set_opengl_camera_to_world(const Matrix4d& camera_to_world) {
  Matrix4d opencv = camera_to_world;
  opencv.block<3, 2>(0, 1) *= -1;
  world_to_camera = rigid_inverse(opencv);
}

std::vector<Vector2d> undistorted_pixel_centres(const Camera& camera) {
  std::vector<Vector2d> points;
  points.reserve(static_cast<std::size_t>(camera.width) * camera.height);
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column)
      points.push_back(camera.undistort({column + 0.5, row + 0.5}));
  }
  return points;
}

Matrix4d look_at(const Vector3d& eye, const Vector3d& target, const Vector3d& up) {
  const Vector3d forward = (target - eye).normalized();
  const Vector3d right = forward.cross(up).normalized();
  if (!(right.norm() > 0.5)) fail("a camera cannot look along its up direction or at itself");
  Matrix4d world_to_camera = Matrix4d::Identity();
  world_to_camera.block<1, 3>(0, 0) = right.transpose();
  world_to_camera.block<1, 3>(1, 0) = forward.cross(right).transpose();
  world_to_camera.block<1, 3>(2, 0) = forward.transpose();
  world_to_camera.topRightCorner<3, 1>() = -world_to_camera.topLeftCorner<3, 3>() * eye;
  return world_to_camera;
}

}  // namespace vivant
