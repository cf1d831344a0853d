#include "vivant/data/retarget.hpp"

#include <Eigen/Geometry>
#include <array>
#include <utility>

#include "vivant/io/json.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// The same joints under two names: CMU's skeleton in MakeHuman's spelling, and SMPL or CMU's motion files.
constexpr std::pair<const char*, const char*> partners[] = {{"Hips", "pelvis"},
                                                            {"LeftUpLeg", "left_hip"},
                                                            {"RightUpLeg", "right_hip"},
                                                            {"LeftLeg", "left_knee"},
                                                            {"RightLeg", "right_knee"},
                                                            {"LeftFoot", "left_ankle"},
                                                            {"RightFoot", "right_ankle"},
                                                            {"LeftToeBase", "left_foot"},
                                                            {"RightToeBase", "right_foot"},
                                                            {"LowerBack", "spine1"},
                                                            {"Spine", "spine2"},
                                                            {"Spine1", "spine3"},
                                                            {"Neck", "neck"},
                                                            {"Head", "head"},
                                                            {"LeftShoulder", "left_collar"},
                                                            {"RightShoulder", "right_collar"},
                                                            {"LeftArm", "left_shoulder"},
                                                            {"RightArm", "right_shoulder"},
                                                            {"LeftForeArm", "left_elbow"},
                                                            {"RightForeArm", "right_elbow"},
                                                            {"LeftHand", "left_wrist"},
                                                            {"RightHand", "right_wrist"},
                                                            {"LeftHandFinger1", "LeftHandIndex1"},
                                                            {"RightHandFinger1", "RightHandIndex1"}};

/// The bones whose direction is kept, by CMU's names: joint and the joint at the bone's end.
constexpr std::pair<const char*, const char*> limb_bones[] = {
    {"LeftUpLeg", "LeftLeg"},     {"LeftLeg", "LeftFoot"},       {"LeftFoot", "LeftToeBase"},
    {"LeftArm", "LeftForeArm"},   {"LeftForeArm", "LeftHand"},   {"RightUpLeg", "RightLeg"},
    {"RightLeg", "RightFoot"},    {"RightFoot", "RightToeBase"}, {"RightArm", "RightForeArm"},
    {"RightForeArm", "RightHand"}};

std::string partner_of(const std::string& name) {
  for (const auto& [cmu, smpl] : partners) {
    if (name == cmu) return smpl;
    if (name == smpl) return cmu;
  }
  return "";
}

/// The index in `body` of the joint that CMU calls `name`.
int body_joint(const Body& body, const char* name) {
  const int found = body.find_joint(name);
  return found >= 0 ? found : body.find_joint(partner_of(name));
}

/// For every body joint the index of its source joint, or -1.
std::vector<int> match_joints(const SkeletonMotion& motion, const Body& body, const JointMapping& mapping,
                              const std::string& source) {
  for (const auto& [name, target] : mapping) {
    if (body.find_joint(name) < 0) fail("the joint mapping names '{}', the body has no such joint", name);
    if (motion.find_joint(target) < 0)
      fail("{}: no joint '{}', which the mapping gives to '{}'", source, target, name);
  }
  std::vector<int> matches;
  for (const std::string& name : body.joint_names) {
    const auto mapped = mapping.find(name);
    int match = motion.find_joint(mapped != mapping.end() ? mapped->second : name);
    if (match < 0) match = motion.find_joint(partner_of(name));
    matches.push_back(match);
  }
  return matches;
}

int required(const std::vector<int>& matches, const Body& body, int joint, const std::string& source) {
  if (matches[joint] >= 0) return matches[joint];
  fail("{}: no joint for the body's '{}'; give a mapping file {{\"{}\": \"its name\", ...}}", source,
       body.joint_names[joint], body.joint_names[joint]);
}

struct Bone {
  int joint, end;                // in the body
  int source_joint, source_end;  // in the motion
};

std::vector<Bone> match_bones(const Body& body, const std::vector<int>& matches, const std::string& source) {
  std::vector<Bone> bones;
  for (const auto& [name, end_name] : limb_bones) {
    const int joint = body_joint(body, name), end = body_joint(body, end_name);
    if (joint < 0 || end < 0)
      fail("{}: the body has no joint '{}' to take the motion", source, joint < 0 ? name : end_name);
    bones.push_back(
        {joint, end, required(matches, body, joint, source), required(matches, body, end, source)});
  }
  return bones;
}

/// A of every body joint (see the header).
std::vector<Matrix3d> rest_alignments(const SkeletonMotion& motion, const Body& body,
                                      const std::vector<Bone>& bones) {
  std::vector<Matrix3d> alignments(body.joints.size(), Matrix3d::Identity());
  for (int joint = 0; joint < body.joint_count(); ++joint) {
    if (body.parents[joint] >= 0) alignments[joint] = alignments[body.parents[joint]];
    for (const Bone& bone : bones) {
      if (bone.joint != joint) continue;
      const Vector3d own = body.joints[bone.end] - body.joints[bone.joint];
      const Vector3d other =
          motion.rest_positions[bone.source_end] - motion.rest_positions[bone.source_joint];
      alignments[joint] = Eigen::Quaterniond::FromTwoVectors(own, other).toRotationMatrix();
    }
  }
  return alignments;
}

/// Metres per unit of the file: the ratio of the left legs' lengths.
double leg_ratio(const SkeletonMotion& motion, const Body& body, const std::vector<Bone>& bones,
                 const std::string& source) {
  double own = 0, other = 0;
  for (const Bone& bone : {bones[0], bones[1]}) {
    own += (body.joints[bone.end] - body.joints[bone.joint]).norm();
    other += (motion.rest_positions[bone.source_end] - motion.rest_positions[bone.source_joint]).norm();
  }
  if (!(other > 0)) fail("{}: its left leg has no length", source);
  return own / other;
}

Pose retargeted_pose(const SkeletonMotion& motion, int frame, const Body& body,
                     const std::vector<int>& matches, const std::vector<Matrix3d>& alignments) {
  std::vector<Matrix3d> source(motion.joint_names.size());
  for (std::size_t j = 0; j < source.size(); ++j) {
    const Matrix3d& local = motion.rotations[frame][j];
    source[j] = motion.parents[j] < 0 ? local : Matrix3d(source[motion.parents[j]] * local);
  }
  std::vector<Matrix3d> global(body.joints.size());
  Pose pose(body.joints.size());
  for (std::size_t j = 0; j < pose.size(); ++j) {
    const Matrix3d above = body.parents[j] < 0 ? Matrix3d::Identity() : global[body.parents[j]];
    global[j] = matches[j] < 0 ? above : Matrix3d(source[matches[j]] * alignments[j]);
    pose[j] = axis_angle_from_rotation(above.transpose() * global[j]);
  }
  return pose;
}

}  // namespace

JointMapping read_joint_mapping(const std::filesystem::path& path) {
  const nlohmann::json json = read_json(path);
  JointMapping mapping;
  if (!json.is_object())
    fail("{}: a joint mapping is an object {{\"body joint\": \"file joint\"}}", path.string());
  for (const auto& [name, target] : json.items()) {
    if (!target.is_string()) fail("{}: '{}' must be the name of a joint", path.string(), name);
    mapping[name] = target.get<std::string>();
  }
  return mapping;
}

Motion retargeted(const SkeletonMotion& motion, const Body& body, const JointMapping& mapping,
                  const std::string& source) {
  const std::vector<int> matches = match_joints(motion, body, mapping, source);
  required(matches, body, 0, source);
  const std::vector<Bone> bones = match_bones(body, matches, source);
  const std::vector<Matrix3d> alignments = rest_alignments(motion, body, bones);
  const double scale = leg_ratio(motion, body, bones, source);
  Motion out;
  out.fps = motion.fps;
  out.joint_names = body.joint_names;
  const Vector3d start = motion.root_positions[0];
  for (std::size_t frame = 0; frame < motion.rotations.size(); ++frame) {
    out.pose.push_back(retargeted_pose(motion, static_cast<int>(frame), body, matches, alignments));
    const Vector3d moved = scale * (motion.root_positions[frame] - start);
    out.translation.emplace_back(moved.x() - body.joints[0].x(), moved.y(), moved.z() - body.joints[0].z());
  }
  const double ground = ground_height(body, out);
  for (Vector3d& translation : out.translation) translation.y() -= ground;
  return out;
}

}  // namespace vivant
