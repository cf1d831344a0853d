#pragma once
#include <vector>

#include "vivant/data/body.hpp"
#include "vivant/data/camera.hpp"
#include "vivant/data/capture.hpp"
#include "vivant/ops/closest_point.hpp"

namespace vivant {

/// A person's body ready for the device: its canonical X-pose, the mesh hierarchy, and graphs that pose it.
class BodyModel {
 public:
  /// `body`: the person's own shape, see shaped(). `box_margin`: metres between the canonical body and the
  /// box of the field. Throws Error when the canonical pose folds a vertex' transform so that it cannot be
  /// inverted.
  explicit BodyModel(Body body, const CanonicalPoseOptions& canonical = {}, double box_margin = 0.1);

  const Body& body() const { return body_; }
  const MeshTopology& topology() const { return topology_; }
  const std::vector<Eigen::Vector3d>& canonical_vertices() const { return canonical_vertices_; }
  /// The canonical body with the margin on every side.
  const Box& canonical_box() const { return canonical_box_; }

  struct Posed {
    PosedMesh mesh;    ///< in the observation
    Value transforms;  ///< [V, 12] of the vertices, canonical -> observation: LBS(pose) LBS(canonical)^-1
  };
  /// Records skinning and refitting for `joint_transforms` [J, 12], which may change from run to run.
  /// Gradients reach the joint transforms through `transforms` (and inverse_warp), with faces and weights
  /// held fixed.
  Posed pose(Graph& graph, Value joint_transforms) const;
  /// Rays [R, 3], [R, 3] in the frame of the posed root joint, [R, 6]: see SampleTable::roots.
  Value root_rays(Value origins, Value directions, Value joint_transforms) const;
  /// The canonical body as a mesh for queries.
  PosedMesh canonical_mesh(Graph& graph) const;

 private:
  Body body_;
  MeshTopology topology_;
  std::vector<Eigen::Vector3d> canonical_vertices_;
  std::vector<double> inverse_canonical_;  // [V, 12] canonical -> rest
  Box canonical_box_;
};

/// Transforms as rows of 12 numbers, for values [J, 12].
std::vector<double> transform_rows(const std::vector<RigidTransform>& transforms);

/// A window of an image; empty when it has no extent.
struct PixelWindow {
  int x = 0, y = 0, width = 0, height = 0;
  bool empty() const { return width <= 0 || height <= 0; }
};

/// The pixels that can see something within `margin` metres of the vertices, cut to the image. The whole
/// image when the camera is that close to a vertex; empty when all are behind it.
PixelWindow visible_window(const Camera& camera, const std::vector<Eigen::Vector3d>& vertices, double margin);

}  // namespace vivant
