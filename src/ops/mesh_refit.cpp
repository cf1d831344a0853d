#include "vivant/graph/launch.hpp"
#include "vivant/ops/closest_point.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::int64_t width = MeshTopology::width, leaf_rows = 13, bound_rows = 6;

std::int64_t parents(std::int64_t children) { return (children + width - 1) / width; }

std::int64_t node_count(std::int64_t leaves) {
  std::int64_t total = 0, level = leaves;
  do {
    level = parents(level);
    total += level;
  } while (level > 1);
  return total;
}

/// Inputs: vertices, triangles, leaf_triangles, corner_offsets, corners. Outputs: leaves, bounds, normals.
struct MeshRefit final : Op {
  std::string_view name() const override { return "mesh_refit"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& vertices = in[0].shape;
    if (vertices.rank() != 2 || vertices[1] != 3)
      fail("[mesh_refit] vertices {} are not [V, 3]", vertices.text());
    for (int i = 1; i < 5; ++i)
      if (in[i].dtype != DType::i32) fail("[mesh_refit] the topology must be i32, input {} is not", i);
    if (in[2].shape.rank() != 2 || in[2].shape[1] != width)
      fail("[mesh_refit] leaf triangles {} are not [L, {}]", in[2].shape.text(), width);
    if (in[3].shape.elements() != vertices[0] + 1 || in[4].shape.elements() != in[1].shape.elements())
      fail("[mesh_refit] corner offsets {} and corners {} do not fit {} vertices and {} triangles",
           in[3].shape.text(), in[4].shape.text(), vertices[0], in[1].shape[0]);
    const std::int64_t leaves = in[2].shape[0];
    return {{DType::real, {leaves, leaf_rows, width}},
            {DType::real, {node_count(leaves), bound_rows, width}},
            {DType::real, vertices}};
  }
  void launch(Launch& launch) const override {
    const Tensor &vertices = launch.in(0), &triangles = launch.in(1), &bounds = launch.out(1);
    const std::array<std::size_t, 3> group{launch.gpu() ? std::size_t{64} : std::size_t{16}, 1, 1};
    std::int64_t children = launch.in(2)[0], first = 0;
    const auto slots = [](std::int64_t count) { return parents(count) * width; };
    const auto items = [](std::int64_t count) {
      return std::array<std::size_t, 3>{static_cast<std::size_t>(count), 1, 1};
    };
    launch.kernel("mesh_refit.cl", "refit_leaves")
        .args(vertices, triangles, launch.in(2), launch.out(0), bounds, children, slots(children))
        .run(items(slots(children)), group);
    for (children = parents(children); children > 1; children = parents(children)) {
      launch.kernel("mesh_refit.cl", "refit_level")
          .args(bounds, first, children, first + children, slots(children))
          .run(items(slots(children)), group);
      first += children;
    }
    launch.kernel("mesh_refit.cl", "vertex_normals")
        .args(vertices, triangles, launch.in(3), launch.in(4), launch.out(2), vertices[0])
        .run(items(vertices[0]), group);
  }
  Values gradient(const GradientRequest&) const override { return Values(5); }
};

const RegisterOp register_mesh_refit({
    .name = "mesh_refit",
    .summary = "the bounds of a mesh's hierarchy and its normals in a new pose",
    .inputs = {{"vertices", "[V, 3]"},
               {"triangles", "[F, 3]", DType::i32},
               {"leaf_triangles", "[L, 16]", DType::i32},
               {"corner_offsets", "[V + 1, 1]", DType::i32},
               {"corners", "[3 F, 1]", DType::i32}},
    .outputs = {{"leaves", "[L, 13, 16]"}, {"bounds", "[nodes, 6, 16]"}, {"normals", "[V, 3]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      const PosedMesh mesh = refit_mesh(in[0], {in[1], in[2], {}, in[3], in[4]});
      return {mesh.leaves, mesh.bounds, mesh.normals};
    },
});

}  // namespace

PosedMesh refit_mesh(Value vertices, const MeshIndex& index) {
  const Values out = vertices.graph->record(
      std::make_shared<MeshRefit>(),
      {vertices, index.triangles, index.leaf_triangles, index.corner_offsets, index.corners});
  return {index, vertices, out[0], out[1], out[2]};
}

}  // namespace vivant
