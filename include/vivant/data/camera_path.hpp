#pragma once
#include <filesystem>
#include <vector>

#include "vivant/data/camera.hpp"

namespace vivant {

/// Cameras for a film, one a frame.
struct CameraPath {
  double fps = 24;
  std::vector<Camera> cameras;
};

/// Reads a path in the keys of transforms.json (docs/capture-format.md): intrinsics, fps and frames with a
/// transform_matrix. A capture's own transforms.json is a path too. Throws Error naming file and frame.
CameraPath read_camera_path(const std::filesystem::path& path);
/// Writes the same form, atomically.
void write_camera_path(const std::filesystem::path& path, const CameraPath& camera_path);

/// `count` cameras that carry `reference` around the axis through `centre` along `up`, from angle `from` to
/// `to` (degrees, 0 is the reference itself), keeping its distance, height and framing. A full turn does not
/// repeat its first camera.
std::vector<Camera> orbit(const Camera& reference, const Eigen::Vector3d& centre, const Eigen::Vector3d& up,
                          double from, double to, int count);

}  // namespace vivant
