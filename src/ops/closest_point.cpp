#include "vivant/ops/closest_point.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// Inputs: points, vertices, leaves, bounds, normals, triangles, leaf_triangles, neighbours.
struct FindClosestPoint final : Op {
  explicit FindClosestPoint(double max_distance) : max_distance(max_distance) {}
  std::string_view name() const override { return "closest_point"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& points = in[0].shape;
    if (points.rank() != 2 || points[1] != 3) fail("[closest_point] points {} are not [N, 3]", points.text());
    if (!(max_distance > 0)) fail("[closest_point] the maximum distance {} is not positive", max_distance);
    const int count = in[0].count;
    return {{DType::i32, {points[0], 1}, count},
            {DType::real, points, count},
            {DType::real, {points[0], 1}, count},
            {DType::real, points, count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& points = launch.in(0);
    const std::size_t queries = launch.gpu() ? 1 : 16, rows = static_cast<std::size_t>(points[0]);
    launch.kernel("closest_point.cl", "closest_point", {{"QUERIES", static_cast<std::int64_t>(queries)}})
        .args(points, launch.in(1), launch.in(2), launch.in(3), launch.in(4), launch.in(5), launch.in(6),
              launch.in(7), launch.out(0), launch.out(1), launch.out(2), launch.out(3), launch.in(6)[0],
              max_distance, points[0], launch.count_of(points))
        .run({(rows + queries - 1) / queries, 1, 1}, {launch.gpu() ? std::size_t{64} : std::size_t{1}, 1, 1});
  }
  Values gradient(const GradientRequest&) const override { return Values(8); }
  const double max_distance;
};

const RegisterOp register_closest_point({
    .name = "closest_point",
    .summary = "the closest point on a triangle mesh, exact, with its signed distance",
    .inputs = {{"points", "[N, 3]"},
               {"vertices", "[V, 3]"},
               {"triangles", "[F, 3]", DType::i32},
               {"leaf_triangles", "[L, 16]", DType::i32},
               {"neighbours", "[F, 3]", DType::i32},
               {"corner_offsets", "[V + 1, 1]", DType::i32},
               {"corners", "[3 F, 1]", DType::i32}},
    .outputs = {{"face", "[N, 1]", DType::i32},
                {"barycentric", "[N, 3]"},
                {"signed_distance", "[N, 1]"},
                {"point", "[N, 3]"}},
    .attributes = {{"max_distance", 0.1, "metres; farther points have face -1"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const PosedMesh mesh = refit_mesh(in[1], {in[2], in[3], in[4], in[5], in[6]});
      const ClosestPoint closest = closest_point(in[0], mesh, a.number("max_distance"));
      return {closest.face, closest.barycentric, closest.signed_distance, closest.point};
    },
});

}  // namespace

ClosestPoint closest_point(Value points, const PosedMesh& mesh, double max_distance) {
  const Values out =
      points.graph->record(std::make_shared<FindClosestPoint>(max_distance),
                           {points, mesh.vertices, mesh.leaves, mesh.bounds, mesh.normals,
                            mesh.index.triangles, mesh.index.leaf_triangles, mesh.index.neighbours});
  return {out[0], out[1], out[2], out[3]};
}

}  // namespace vivant
