#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace vivant {

/// One axis-angle rotation per joint, in radians, relative to the rest pose.
using Pose = std::vector<Eigen::Vector3d>;
/// Maps a point: x' = T [x; 1].
using RigidTransform = Eigen::Matrix<double, 3, 4>;

/// A rigged triangle mesh in its rest pose: V vertices, T triangles, J joints, K skinning weights a vertex, S
/// shape directions. Metres, y up, facing +z, left is +x. Parents come before their children; the root is
/// joint 0.
struct Body {
  std::vector<Eigen::Vector3d> vertices;      ///< [V]
  std::vector<Eigen::Vector3i> triangles;     ///< [T] indices into vertices, counter-clockwise from outside
  std::vector<Eigen::Vector2d> uv;            ///< [U] texture coordinates, empty when the file has none
  std::vector<Eigen::Vector3i> uv_triangles;  ///< [T] indices into uv
  std::vector<Eigen::Vector3d> joints;        ///< [J]
  std::vector<Eigen::Vector3d> tails;         ///< [J] the bones' other ends, empty when the file has none
  std::vector<int> parents;                   ///< [J] the root has -1
  std::vector<std::string> joint_names;       ///< [J]
  int influences = 0;                         ///< K
  std::vector<int> skin_joints;               ///< [V, K]
  std::vector<double> skin_weights;           ///< [V, K], each row sums to 1
  std::vector<std::vector<Eigen::Vector3d>> shape_dirs;  ///< [S][V] metres per unit coefficient
  std::vector<std::vector<Eigen::Vector3d>> joint_dirs;  ///< [S][J]

  int joint_count() const { return static_cast<int>(joints.size()); }
  /// Index of a joint, or -1.
  int find_joint(const std::string& name) const;
};

/// Loads a body from .safetensors (docs/capture-format.md) or from an SMPL model as .npz (keys v_template, f,
/// weights, J_regressor, kintree_table, shapedirs; pose blend shapes are left out). Throws Error naming file
/// and tensor.
Body load_body(const std::filesystem::path& path);

/// Writes a body in the safetensors form.
void save_body(const std::filesystem::path& path, const Body& body);

/// The body with `coefficients` of its shape directions added to vertices, joints and tails. Fewer
/// coefficients than directions count as zero; more are an error.
Body shaped(const Body& body, std::span<const double> coefficients);

/// The transform of every joint that maps rest points to posed points, for linear blend skinning:
///   G_0 = [R_0 | J_0 + translation],  G_j = G_parent [R_j | J_j - J_parent],  result_j = G_j [I | -J_j].
std::vector<RigidTransform> joint_transforms(const Body& body, const Pose& pose,
                                             const Eigen::Vector3d& translation);

/// Positions of the posed joints.
std::vector<Eigen::Vector3d> posed_joints(const Body& body, const std::vector<RigidTransform>& transforms);

/// Posed vertices: v' = sum_k w_k T_k v.
std::vector<Eigen::Vector3d> skin(const Body& body, const std::vector<RigidTransform>& transforms);
/// The same in a pose.
std::vector<Eigen::Vector3d> posed_vertices(const Body& body, const Pose& pose,
                                            const Eigen::Vector3d& translation);

/// Area-weighted unit normals of the vertices of a mesh.
std::vector<Eigen::Vector3d> vertex_normals(std::span<const Eigen::Vector3d> vertices,
                                            std::span<const Eigen::Vector3i> triangles);

/// Angles of the canonical X-pose in radians, about the forward axis +z.
struct CanonicalPoseOptions {
  double leg_angle = 0.5;  ///< upper legs turned out
  double arm_angle = 0.0;  ///< upper arms raised
};

/// The X-pose: left upper leg +leg_angle, right -leg_angle, left upper arm +arm_angle, right -arm_angle about
/// +z, all else at rest. Joints are found by name; throws Error when the body has no upper legs.
Pose canonical_pose(const Body& body, const CanonicalPoseOptions& options = {});

/// Rotation matrix of an axis-angle vector (radians) and its inverse.
Eigen::Matrix3d rotation_from_axis_angle(const Eigen::Vector3d& axis_angle);
Eigen::Vector3d axis_angle_from_rotation(const Eigen::Matrix3d& rotation);

}  // namespace vivant
