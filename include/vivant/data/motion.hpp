#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "vivant/data/body.hpp"

namespace vivant {

/// Body poses over time: F frames of J joints. `translation` is added to the rest position of the root joint
/// (metres).
struct Motion {
  double fps = 30;
  std::vector<std::string> joint_names;      ///< [J], empty when the file does not name them
  std::vector<Pose> pose;                    ///< [F][J]
  std::vector<Eigen::Vector3d> translation;  ///< [F]
  std::vector<double> shape;                 ///< coefficients of the body's shape directions, may be empty

  int frame_count() const { return static_cast<int>(pose.size()); }
};

/// Vertices of the body in a frame of the motion.
std::vector<Eigen::Vector3d> posed_vertices(const Body& body, const Motion& motion, int frame);

/// Where a motion stands: the root of its first frame above (x, z), its ground at height y, facing `yaw`
/// degrees about +y (0 faces +z, 90 faces +x).
struct Placement {
  double x = 0, y = 0, z = 0, yaw = 0;
};

/// Reads poses from .safetensors: pose [F,J,3], trans [F,3], optional shape [S], fps and joint_names in the
/// metadata. Throws Error naming file, frame and joint for a value that is not finite.
Motion load_poses(const std::filesystem::path& path);
/// Writes the same form.
void save_poses(const std::filesystem::path& path, const Motion& motion);

/// Loads a motion for `body`: .safetensors poses, .bvh (retargeted by joint names) or AMASS .npz.
/// `mapping_path` is an optional JSON object {body joint: file joint} for BVH files with other names. Throws
/// Error when the joints disagree.
Motion load_motion(const std::filesystem::path& path, const Body& body,
                   const std::filesystem::path& mapping_path = {});

/// The motion at another frame rate: rotations along the shortest arc, translations linearly.
Motion resampled(const Motion& motion, double fps);

/// Height of the ground: where the lowest vertex mostly is, the middle of the narrowest range of heights that
/// holds a third of the frames. Feet that stand stay at one height, while jumps, and the frames of a fit or
/// of a retargeted clip that sink too deep, scatter: a low percentile would take the deepest errors for the
/// ground.
double ground_height(const Body& body, const Motion& motion);

/// Heading of a root rotation: degrees about +y of the rotated +z axis (0 faces +z, 90 faces +x).
double heading(const Eigen::Vector3d& root_axis_angle);

/// The motion moved by a yaw, a horizontal shift and a height so that it stands at `placement`.
Motion placed(const Body& body, const Motion& motion, const Placement& placement);

/// Where the motion stands in a frame: root, heading and ground; placed(body, other, standing_at(...)) puts
/// another motion in its stead.
Placement standing_at(const Body& body, const Motion& motion, int frame = 0);

/// Throws Error naming `source`, frame and joint unless every frame has `joint_count` finite rotations.
void check_motion(const Motion& motion, int joint_count, const std::string& source);

}  // namespace vivant
