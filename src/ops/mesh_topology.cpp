#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>

#include "vivant/ops/closest_point.hpp"

namespace vivant {
namespace {

using Eigen::Vector3d;

/// Orders triangles so that the implicit tree over runs of 16, 256, 4096, ... has compact nodes.
class SpatialOrder {
 public:
  explicit SpatialOrder(const std::vector<Vector3d>& centres) : centres_(centres), order_(centres.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    divide(0, order_.size());
  }
  const std::vector<std::int32_t>& order() const { return order_; }

 private:
  /// Cuts a node's range into at most 16 children, all but the last of the same power-of-16 size.
  void divide(std::size_t begin, std::size_t end) {
    if (end - begin <= MeshTopology::width) return;
    std::size_t child = MeshTopology::width;
    while (child * MeshTopology::width < end - begin) child *= MeshTopology::width;
    halve(begin, end, child);
    for (std::size_t i = begin; i < end; i += child) divide(i, std::min(i + child, end));
  }

  void halve(std::size_t begin, std::size_t end, std::size_t child) {
    const std::size_t children = (end - begin + child - 1) / child;
    if (children == 1) return;
    const std::size_t middle = begin + children / 2 * child;
    Eigen::AlignedBox3d box;
    for (std::size_t i = begin; i < end; ++i) box.extend(centres_[order_[i]]);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](int a, int b) {
                       const double x = centres_[a][axis], y = centres_[b][axis];
                       return x != y ? x < y : a < b;
                     });
    halve(begin, middle, child);
    halve(middle, end, child);
  }

  const std::vector<Vector3d>& centres_;
  std::vector<std::int32_t> order_;
};

/// The triangle across each edge; -1 at a border and where more than two triangles meet.
std::vector<std::int32_t> edge_neighbours(std::span<const Eigen::Vector3i> triangles) {
  std::map<std::pair<int, int>, std::vector<std::int32_t>> edges;  // corners 3 * triangle + k on each edge
  for (std::size_t f = 0; f < triangles.size(); ++f)
    for (int k = 0; k < 3; ++k)
      edges[std::minmax({triangles[f][k], triangles[f][(k + 1) % 3]})].push_back(
          static_cast<std::int32_t>(3 * f + k));
  std::vector<std::int32_t> neighbours(3 * triangles.size(), -1);
  for (const auto& [edge, corners] : edges)
    if (corners.size() == 2)
      for (int side = 0; side < 2; ++side) neighbours[corners[side]] = corners[1 - side] / 3;
  return neighbours;
}

}  // namespace

MeshTopology mesh_topology(std::span<const Vector3d> vertices, std::span<const Eigen::Vector3i> triangles) {
  if (triangles.empty() || triangles.size() > (std::size_t{1} << 24))
    fail("a mesh of {} triangles cannot be searched for closest points", triangles.size());
  MeshTopology topology;
  topology.vertex_count = static_cast<std::int64_t>(vertices.size());
  std::vector<Vector3d> centres;
  for (const Eigen::Vector3i& t : triangles) {
    topology.triangles.insert(topology.triangles.end(), {t[0], t[1], t[2]});
    centres.push_back((vertices[t[0]] + vertices[t[1]] + vertices[t[2]]) / 3);
  }
  topology.leaf_triangles = SpatialOrder(centres).order();
  while (topology.leaf_triangles.size() % MeshTopology::width != 0)
    topology.leaf_triangles.push_back(topology.leaf_triangles.back());
  topology.neighbours = edge_neighbours(triangles);

  topology.corner_offsets.assign(vertices.size() + 1, 0);
  for (std::int32_t vertex : topology.triangles) ++topology.corner_offsets[vertex + 1];
  std::partial_sum(topology.corner_offsets.begin(), topology.corner_offsets.end(),
                   topology.corner_offsets.begin());
  std::vector<std::int32_t> next(topology.corner_offsets.begin(), topology.corner_offsets.end() - 1);
  topology.corners.resize(topology.triangles.size());
  for (std::size_t corner = 0; corner < topology.corners.size(); ++corner)
    topology.corners[next[topology.triangles[corner]]++] = static_cast<std::int32_t>(corner);
  return topology;
}

MeshIndex mesh_index(Graph& graph, const MeshTopology& topology) {
  const auto constant = [&](const std::vector<std::int32_t>& data, std::int64_t columns) {
    const auto rows = static_cast<std::int64_t>(data.size()) / columns;
    return graph.constant({rows, columns}, std::span<const std::int32_t>(data));
  };
  return {constant(topology.triangles, 3), constant(topology.leaf_triangles, MeshTopology::width),
          constant(topology.neighbours, 3), constant(topology.corner_offsets, 1),
          constant(topology.corners, 1)};
}

}  // namespace vivant
