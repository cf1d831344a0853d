#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "vivant/graph/graph.hpp"

namespace vivant {

/// What closest-point queries need to know of a mesh's connectivity, whatever its pose; made once per mesh on
/// the host. The bounding-volume hierarchy is implicit: leaf l holds triangles leaf_triangles[16 l, 16 l +
/// 16), its parent is node l / 16 of the lowest level, and so on up to a single root.
struct MeshTopology {
  static constexpr int width = 16;           ///< children of a node, triangles of a leaf
  std::int64_t vertex_count = 0;             ///< V
  std::vector<std::int32_t> triangles;       ///< [F, 3] vertices, counter-clockwise from outside
  std::vector<std::int32_t> leaf_triangles;  ///< [L, 16] triangles in spatial order; the last one is repeated
  std::vector<std::int32_t> neighbours;      ///< [F, 3] the triangle across edge k (corner k to k + 1), or -1
  std::vector<std::int32_t> corner_offsets;  ///< [V + 1] where each vertex' corners begin
  std::vector<std::int32_t> corners;         ///< [3 F] 3 * triangle + corner, by vertex
};

/// Orders the triangles by recursive halving of `vertices`' longest extent, so that a pose near to this one
/// has tight bounds. Throws Error for a mesh without triangles or with more than 2^24 of them.
MeshTopology mesh_topology(std::span<const Eigen::Vector3d> vertices,
                           std::span<const Eigen::Vector3i> triangles);

/// The same on the device.
struct MeshIndex {
  Value triangles, leaf_triangles, neighbours, corner_offsets, corners;  ///< i32, shapes as in MeshTopology
};

/// As constants of a graph.
MeshIndex mesh_index(Graph& graph, const MeshTopology& topology);

/// A mesh in one pose, ready for queries.
struct PosedMesh {
  MeshIndex index;
  Value vertices;  ///< [V, 3]
  Value leaves;    ///< [L, 13, 16] corner, two edges and reciprocals of every triangle, 16 side by side
  Value bounds;    ///< [nodes, 6, 16] lower and upper corners of the children's boxes
  Value normals;   ///< [V, 3] angle-weighted
};

/// Computes bounds and normals on the device, level by level from the leaves.
PosedMesh refit_mesh(Value vertices, const MeshIndex& index);

struct ClosestPoint {
  Value face;         ///< i32 [N, 1] the closest triangle, -1 when it is farther than the maximum distance
  Value barycentric;  ///< [N, 3] weights of its corners; 0 when there is none
  Value signed_distance;  ///< [N, 1] metres, negative inside; the maximum distance when there is none
  Value point;            ///< [N, 3] the closest point; the query itself when there is none
};

/// The closest point on a mesh of every point [N, 3] (N may carry a device-side count). Exact: no
/// triangle is closer by more than a relative 1e-6. The sign is that of the angle-weighted pseudo-normal of
/// the closest face, edge or vertex (Baerentzen and Aanaes 2005), right for every point of a closed mesh.
/// Gradients take all results for constant.
ClosestPoint closest_point(Value points, const PosedMesh& mesh, double max_distance);

}  // namespace vivant
