// load_motion: chooses the reader by the extension; AMASS archives.
#include <Eigen/Geometry>
#include <cmath>

#include "vivant/data/motion.hpp"
#include "vivant/data/retarget.hpp"
#include "vivant/io/npz.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// The joints that SMPL, SMPL-H and SMPL-X share, in the order of their files, with their parents and round
/// positions (metres) of a person in T-pose. Only the bones' directions and the legs' length matter.
struct NominalJoint {
  const char* name;
  int parent;
  double x, y, z;
};
constexpr NominalJoint nominal_joints[] = {{"pelvis", -1, 0, 0.95, 0},
                                           {"left_hip", 0, 0.06, 0.86, 0},
                                           {"right_hip", 0, -0.06, 0.86, 0},
                                           {"spine1", 0, 0, 1.06, -0.02},
                                           {"left_knee", 1, 0.1, 0.48, 0},
                                           {"right_knee", 2, -0.1, 0.48, 0},
                                           {"spine2", 3, 0, 1.2, 0},
                                           {"left_ankle", 4, 0.09, 0.08, -0.04},
                                           {"right_ankle", 5, -0.09, 0.08, -0.04},
                                           {"spine3", 6, 0, 1.25, 0},
                                           {"left_foot", 7, 0.12, 0.02, 0.08},
                                           {"right_foot", 8, -0.12, 0.02, 0.08},
                                           {"neck", 9, 0, 1.46, -0.03},
                                           {"left_collar", 9, 0.08, 1.37, -0.02},
                                           {"right_collar", 9, -0.08, 1.37, -0.02},
                                           {"head", 12, 0, 1.53, 0.02},
                                           {"left_shoulder", 13, 0.17, 1.4, -0.03},
                                           {"right_shoulder", 14, -0.17, 1.4, -0.03},
                                           {"left_elbow", 16, 0.43, 1.39, -0.05},
                                           {"right_elbow", 17, -0.43, 1.39, -0.05},
                                           {"left_wrist", 18, 0.68, 1.4, -0.05},
                                           {"right_wrist", 19, -0.68, 1.4, -0.05}};
constexpr int shared_joints = std::size(nominal_joints);

/// AMASS is z up: (x, y, z) becomes (x, z, -y).
Matrix3d z_up_to_y_up() { return Eigen::AngleAxisd(-M_PI / 2, Vector3d::UnitX()).toRotationMatrix(); }

double frame_rate(const TensorFile& file) {
  for (const char* key : {"mocap_framerate", "mocap_frame_rate"}) {
    if (!file.contains(key)) continue;
    const std::vector<double> values = file.at(key).as_doubles();
    if (values.size() == 1) return values[0];
  }
  fail("{}: 'mocap_framerate' is missing or not one number", file.source);
}

Motion load_amass(const std::filesystem::path& path, const Body& body, const JointMapping& mapping) {
  const TensorFile file = read_npz(path);
  const HostTensor& poses = file.at("poses", {-1, -1});
  const std::int64_t frames = poses.shape[0], joints = poses.shape[1] / 3;
  if (joints < shared_joints || poses.shape[1] % 3 != 0) {
    fail("{}: 'poses' is {}, {} or more values a frame are needed", file.source, poses.describe(),
         3 * shared_joints);
  }
  const std::vector<double> rotations = poses.as_doubles();
  const std::vector<double> positions = file.at("trans", {frames, 3}).as_doubles();
  Motion raw;
  raw.fps = frame_rate(file);
  for (const NominalJoint& joint : nominal_joints) raw.joint_names.emplace_back(joint.name);
  for (std::int64_t f = 0; f < frames; ++f) {
    Pose pose(shared_joints);
    for (int j = 0; j < shared_joints; ++j) pose[j] = Vector3d(rotations.data() + 3 * (f * joints + j));
    raw.pose.push_back(std::move(pose));
    raw.translation.emplace_back(positions.data() + 3 * f);
  }
  check_motion(raw, shared_joints, file.source);
  SkeletonMotion motion;
  motion.fps = raw.fps;
  for (const NominalJoint& joint : nominal_joints) {
    motion.joint_names.emplace_back(joint.name);
    motion.parents.push_back(joint.parent);
    motion.rest_positions.emplace_back(joint.x, joint.y, joint.z);
  }
  const bool smpl = body.find_joint("pelvis") == 0;
  // On an SMPL body the rest poses agree: with the body's own joints every alignment is the identity.
  for (int j = 0; smpl && j < shared_joints; ++j) {
    const int own = body.find_joint(motion.joint_names[j]);
    if (own >= 0) motion.rest_positions[j] = body.joints[own];
  }
  const Matrix3d turn = z_up_to_y_up();
  for (std::int64_t f = 0; f < frames; ++f) {
    std::vector<Matrix3d> local;
    for (const Vector3d& rotation : raw.pose[f]) local.push_back(rotation_from_axis_angle(rotation));
    local[0] = turn * local[0];
    motion.rotations.push_back(std::move(local));
    motion.root_positions.push_back(turn * raw.translation[f]);
  }
  return retargeted(motion, body, mapping, file.source);
}

}  // namespace

Motion load_motion(const std::filesystem::path& path, const Body& body,
                   const std::filesystem::path& mapping_path) {
  const std::string extension = path.extension().string();
  const JointMapping mapping = mapping_path.empty() ? JointMapping{} : read_joint_mapping(mapping_path);
  if (extension == ".bvh") return retargeted(read_bvh(path), body, mapping, path.string());
  if (extension == ".npz") return load_amass(path, body, mapping);
  if (extension != ".safetensors") {
    throw UsageError(fmt::format("'{}': a motion is a .safetensors, .bvh or .npz file", path.string()));
  }
  if (!mapping_path.empty()) {
    throw UsageError(fmt::format(
        "'{}': poses in .safetensors belong to a body, a mapping file does not apply", path.string()));
  }
  Motion motion = load_poses(path);
  check_motion(motion, body.joint_count(), path.string());
  if (!motion.joint_names.empty() && motion.joint_names != body.joint_names) {
    fail("{}: its joint names are not the body's", path.string());
  }
  return motion;
}

}  // namespace vivant
