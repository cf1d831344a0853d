#pragma once
#include <Eigen/Core>
#include <vector>

namespace vivant {

/// A ray in world space; `direction` has unit length.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

/// A pinhole camera with OpenCV's distortion (k1, k2 radial; p1, p2 tangential) and OpenCV axes: x right, y
/// down, z forward. Pixel (column, row) has its centre at (column + 0.5, row + 0.5).
struct Camera {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;
  Eigen::Matrix4d world_to_camera = Eigen::Matrix4d::Identity();

  /// Position of the optical centre in the world.
  Eigen::Vector3d centre() const;
  /// Optical axis in the world, unit length.
  Eigen::Vector3d forward() const;
  bool distorted() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0; }

  /// Image position (pixels; centres at +0.5) to undistorted coordinates (x/z, y/z) in the camera.
  Eigen::Vector2d undistort(const Eigen::Vector2d& pixel) const;
  /// Undistorted (x/z, y/z) to an image position.
  Eigen::Vector2d distort(const Eigen::Vector2d& normalised) const;
  /// The world ray through an image position.
  Ray ray(const Eigen::Vector2d& pixel) const;
  /// Image position (x, y) and depth along the optical axis (z, metres) of a world point; z <= 0 is behind
  /// the camera.
  Eigen::Vector3d project(const Eigen::Vector3d& world) const;

  /// The same view at another image size.
  Camera resized(int new_width, int new_height) const;

  /// camera_to_world with OpenGL axes (x right, y up, z backward), as capture files hold it.
  Eigen::Matrix4d opengl_camera_to_world() const;
  void set_opengl_camera_to_world(const Eigen::Matrix4d& camera_to_world);
};

/// The undistorted (x/z, y/z) of every pixel centre, [height * width] in row order: the rays of a whole
/// image.
std::vector<Eigen::Vector2d> undistorted_pixel_centres(const Camera& camera);

/// world_to_camera of a camera at `eye` that looks at `target`, with `up` upwards in the image.
Eigen::Matrix4d look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& up);

}  // namespace vivant
