#include "vivant/data/body.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

int Body::find_joint(const std::string& name) const {
  const auto found = std::find(joint_names.begin(), joint_names.end(), name);
  return found == joint_names.end() ? -1 : static_cast<int>(found - joint_names.begin());
}

Body shaped(const Body& body, std::span<const double> coefficients) {
  if (coefficients.size() > body.shape_dirs.size()) {
    fail("{} shape coefficients for a body with {} shape directions", coefficients.size(),
         body.shape_dirs.size());
  }
  Body out = body;
  for (std::size_t s = 0; s < coefficients.size(); ++s) {
    for (std::size_t v = 0; v < out.vertices.size(); ++v)
      out.vertices[v] += coefficients[s] * body.shape_dirs[s][v];
    for (std::size_t j = 0; j < out.joints.size(); ++j) {
      out.joints[j] += coefficients[s] * body.joint_dirs[s][j];
      if (!out.tails.empty()) out.tails[j] += coefficients[s] * body.joint_dirs[s][j];
    }
  }
  return out;
}

std::vector<RigidTransform> joint_transforms(const Body& body, const Pose& pose,
                                             const Vector3d& translation) {
  const int count = body.joint_count();
  if (static_cast<int>(pose.size()) != count) {
    fail("a pose of {} joints for a body with {} joints", pose.size(), count);
  }
  std::vector<RigidTransform> global(count);
  for (int j = 0; j < count; ++j) {
    const Matrix3d rotation = rotation_from_axis_angle(pose[j]);
    const int parent = body.parents[j];
    if (parent < 0) {
      global[j] << rotation, body.joints[j] + translation;
    } else {
      const RigidTransform& above = global[parent];
      global[j] << above.leftCols<3>() * rotation,
          above.leftCols<3>() * (body.joints[j] - body.joints[parent]) + above.col(3);
    }
  }
  for (int j = 0; j < count; ++j) global[j].col(3) -= global[j].leftCols<3>() * body.joints[j];
  return global;
}

std::vector<Vector3d> posed_joints(const Body& body, const std::vector<RigidTransform>& transforms) {
  std::vector<Vector3d> out(body.joints.size());
  for (std::size_t j = 0; j < out.size(); ++j) out[j] = transforms[j] * body.joints[j].homogeneous();
  return out;
}

std::vector<Vector3d> skin(const Body& body, const std::vector<RigidTransform>& transforms) {
  std::vector<Vector3d> out(body.vertices.size());
  for (std::size_t v = 0; v < out.size(); ++v) {
    RigidTransform blend = RigidTransform::Zero();
    for (int k = 0; k < body.influences; ++k) {
      const std::size_t at = v * body.influences + k;
      if (body.skin_weights[at] != 0) blend += body.skin_weights[at] * transforms[body.skin_joints[at]];
    }
    out[v] = blend * body.vertices[v].homogeneous();
  }
  return out;
}

std::vector<Vector3d> posed_vertices(const Body& body, const Pose& pose, const Vector3d& translation) {
  return skin(body, joint_transforms(body, pose, translation));
}

std::vector<Vector3d> vertex_normals(std::span<const Vector3d> vertices,
                                     std::span<const Vector3i> triangles) {
  std::vector<Vector3d> normals(vertices.size(), Vector3d::Zero());
  for (const Vector3i& t : triangles) {
    const Vector3d normal = (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
    for (int corner : {t[0], t[1], t[2]}) normals[corner] += normal;
  }
  for (Vector3d& normal : normals) normal.normalize();
  return normals;
}

Pose canonical_pose(const Body& body, const CanonicalPoseOptions& options) {
  // The names of MakeHuman's CMU rig and of SMPL.
  const auto joint = [&](const std::array<const char*, 2>& names) {
    for (const char* name : names) {
      const int found = body.find_joint(name);
      if (found >= 0) return found;
    }
    fail("the canonical pose needs a joint called '{}' or '{}', the body has none", names[0], names[1]);
  };
  Pose pose(body.joints.size(), Vector3d::Zero());
  pose[joint({"LeftUpLeg", "left_hip"})].z() = options.leg_angle;
  pose[joint({"RightUpLeg", "right_hip"})].z() = -options.leg_angle;
  if (options.arm_angle != 0) {
    pose[joint({"LeftArm", "left_shoulder"})].z() = options.arm_angle;
    pose[joint({"RightArm", "right_shoulder"})].z() = -options.arm_angle;
  }
  return pose;
}

Matrix3d rotation_from_axis_angle(const Vector3d& axis_angle) {
  const double angle = axis_angle.norm();
  if (angle == 0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, axis_angle / angle).toRotationMatrix();
}

Vector3d axis_angle_from_rotation(const Matrix3d& rotation) {
  const Eigen::AngleAxisd axis_angle(rotation);
  return axis_angle.angle() * axis_angle.axis();
}

}  // namespace vivant
