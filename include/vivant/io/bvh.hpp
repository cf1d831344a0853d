#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace vivant {

/// Motion of a skeleton as motion-capture files hold it: B joints with their rest positions, F frames.
/// Lengths are in the file's unit; y is up and the rest pose faces +z.
struct SkeletonMotion {
  std::vector<std::string> joint_names;         ///< [B], parents before their children
  std::vector<int> parents;                     ///< [B], the root has -1
  std::vector<Eigen::Vector3d> rest_positions;  ///< [B]
  double fps = 0;
  std::vector<std::vector<Eigen::Matrix3d>> rotations;  ///< [F][B] relative to the parent
  std::vector<Eigen::Vector3d> root_positions;          ///< [F]

  /// Index of a joint, or -1.
  int find_joint(const std::string& name) const;
};

/// Reads a Biovision hierarchy (.bvh): any order of rotation channels; position channels count for the root
/// alone. Throws Error with the line number when the file is malformed or cut short.
SkeletonMotion read_bvh(const std::filesystem::path& path);

}  // namespace vivant
