#include "vivant/model/body_model.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "vivant/ops/body_skinning.hpp"
#include "vivant/ops/human_samples.hpp"

namespace vivant {
namespace {

using Eigen::Vector3d;

std::span<const double> numbers(const std::vector<Vector3d>& points) {
  return {points[0].data(), 3 * points.size()};
}

/// The inverse of the blended transform of each vertex.
std::vector<RigidTransform> inverse_blends(const Body& body, const std::vector<RigidTransform>& transforms) {
  std::vector<RigidTransform> inverses;
  for (std::size_t v = 0; v < body.vertices.size(); ++v) {
    RigidTransform blend = RigidTransform::Zero();
    for (int k = 0; k < body.influences; ++k) {
      const std::size_t at = v * body.influences + k;
      blend += body.skin_weights[at] * transforms[body.skin_joints[at]];
    }
    const Eigen::Matrix3d turn = blend.leftCols<3>();
    if (!(turn.determinant() > 0.02))
      fail("the canonical pose folds vertex {} of the body: choose smaller angles", v);
    RigidTransform inverse;
    inverse.leftCols<3>() = turn.inverse();
    inverse.col(3) = -inverse.leftCols<3>() * blend.col(3);
    inverses.push_back(inverse);
  }
  return inverses;
}

}  // namespace

std::vector<double> transform_rows(const std::vector<RigidTransform>& transforms) {
  std::vector<double> rows;
  for (const RigidTransform& t : transforms)
    for (int r = 0; r < 3; ++r) rows.insert(rows.end(), {t(r, 0), t(r, 1), t(r, 2), t(r, 3)});
  return rows;
}

BodyModel::BodyModel(Body body, const CanonicalPoseOptions& canonical, double box_margin)
    : body_(std::move(body)) {
  const auto transforms = joint_transforms(body_, canonical_pose(body_, canonical), Vector3d::Zero());
  canonical_vertices_ = skin(body_, transforms);
  inverse_canonical_ = transform_rows(inverse_blends(body_, transforms));
  topology_ = mesh_topology(canonical_vertices_, body_.triangles);
  Eigen::AlignedBox3d box;
  for (const Vector3d& vertex : canonical_vertices_) box.extend(vertex);
  canonical_box_ = {box.min() - Vector3d::Constant(box_margin), box.max() + Vector3d::Constant(box_margin)};
}

BodyModel::Posed BodyModel::pose(Graph& graph, Value joint_transforms) const {
  const Graph::Scope scope(graph, "body");
  const auto vertices = static_cast<std::int64_t>(body_.vertices.size());
  const std::int64_t influences = body_.influences;
  const Value rest = graph.constant({vertices, 3}, numbers(body_.vertices));
  const Value joints =
      graph.constant({vertices, influences}, std::span<const std::int32_t>(body_.skin_joints));
  const Value weights = graph.constant({vertices, influences}, std::span<const double>(body_.skin_weights));
  const Value inverse = graph.constant({vertices, 12}, std::span<const double>(inverse_canonical_));
  const SkinnedBody skinned = body_skinning(rest, joint_transforms, joints, weights);
  return {refit_mesh(skinned.vertices, mesh_index(graph, topology_)),
          compose_transforms(skinned.transforms, inverse)};
}

Value BodyModel::root_rays(Value origins, Value directions, Value joint_transforms) const {
  return vivant::root_rays(origins, directions, joint_transforms, body_.joints[0]);
}

PosedMesh BodyModel::canonical_mesh(Graph& graph) const {
  const Graph::Scope scope(graph, "canonical_body");
  const auto vertices = static_cast<std::int64_t>(canonical_vertices_.size());
  return refit_mesh(graph.constant({vertices, 3}, numbers(canonical_vertices_)),
                    mesh_index(graph, topology_));
}

PixelWindow visible_window(const Camera& camera, const std::vector<Vector3d>& vertices, double margin) {
  double left = INFINITY, top = INFINITY, right = -INFINITY, bottom = -INFINITY;
  for (const Vector3d& vertex : vertices) {
    const Vector3d seen = camera.project(vertex);
    if (seen.z() < -margin) continue;
    if (seen.z() < 2 * margin) return {0, 0, camera.width, camera.height};
    // The silhouette of a ball reaches a little farther than its radius; 1.2 covers fields of view up to 110
    // degrees.
    const double x = 1.2 * camera.fx * margin / (seen.z() - margin),
                 y = 1.2 * camera.fy * margin / (seen.z() - margin);
    left = std::min(left, seen.x() - x);
    right = std::max(right, seen.x() + x);
    top = std::min(top, seen.y() - y);
    bottom = std::max(bottom, seen.y() + y);
  }
  PixelWindow window;
  if (!(left <= right)) return window;
  window.x = static_cast<int>(std::clamp(std::floor(left), 0.0, 1.0 * camera.width));
  window.y = static_cast<int>(std::clamp(std::floor(top), 0.0, 1.0 * camera.height));
  window.width = static_cast<int>(std::clamp(std::ceil(right), 0.0, 1.0 * camera.width)) - window.x;
  window.height = static_cast<int>(std::clamp(std::ceil(bottom), 0.0, 1.0 * camera.height)) - window.y;
  return window;
}

}  // namespace vivant
