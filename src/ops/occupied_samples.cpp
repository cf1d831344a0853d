#include "vivant/ops/occupied_samples.hpp"

#include <cmath>

#include "ops/scan.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct MarkOccupied final : Op {
  explicit MarkOccupied(double threshold) : threshold(threshold) {}
  std::string_view name() const override { return "occupied_samples"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &grid = in[0].shape, &points = in[1].shape, &deltas = in[2].shape;
    if (grid.rank() != 4 || grid[3] != 2)
      fail("[occupied_samples] the grid must be [D, H, W, 2], it is {}", grid.text());
    if (deltas.rank() != 2)
      fail("[occupied_samples] deltas must be [rays, samples], they are {}", deltas.text());
    if (points.rank() != 2 || points[1] != 3 || points[0] != deltas.elements())
      fail("[occupied_samples] points must be [{}, 3], they are {}", deltas.elements(), points.text());
    if (!(threshold > 0)) fail("[occupied_samples] the threshold {} is not positive", threshold);
    return {{DType::i32, deltas}, {DType::i32, {deltas.elements(), 1}}, {DType::i32, {1}}};
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    const std::int64_t rays = in[2].shape[0];
    return {{DType::i32, {rays}},
            {DType::i32, {scan_chunks_of(rays)}},
            {DType::i32, {rays + 1}},
            {DType::i32, {1}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &grid = launch.in(0), &points = launch.in(1), &deltas = launch.in(2);
    const Tensor &counts = launch.workspace(0), &starts = launch.workspace(2);
    const std::int64_t rays = deltas[0], samples = deltas[1];
    const std::array<std::size_t, 3> items{static_cast<std::size_t>(rays), 1, 1}, local{64, 1, 1};
    launch.kernel("occupied_samples.cl", "mark_samples")
        .args(grid, points, deltas, launch.out(0), counts, rays, samples, grid[0], grid[1], grid[2],
              threshold, -std::log(threshold))
        .run(items, local);
    scan_counts(launch, counts, launch.workspace(1), starts, launch.out(2), launch.workspace(3), rays,
                rays * samples);
    launch.kernel("occupied_samples.cl", "number_samples")
        .args(starts, launch.out(2), launch.out(0), launch.out(1), rays, samples)
        .run(items, local);
  }
  Values gradient(const GradientRequest&) const override { return Values(3); }
  const double threshold;
};

const RegisterOp registration({
    .name = "occupied_samples",
    .summary = "the samples of rays that may weigh something, by a grid of density bounds",
    .inputs = {{"grid", "[D, H, W, 2]"}, {"points", "[R * S, 3]"}, {"deltas", "[R, S]"}},
    .outputs = {{.name = "rows", .shape = "[R, S]", .dtype = DType::i32},
                {.name = "ids", .shape = "[R * S, 1]", .dtype = DType::i32},
                {.name = "count", .shape = "[1]", .dtype = DType::i32}},
    .attributes = {{"threshold", 1e-4, "the least weight that counts"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const OccupiedSamples found = occupied_samples(in[0], in[1], in[2], a.number("threshold"));
      return {found.rows, found.ids, found.count};
    },
});

}  // namespace

OccupiedSamples occupied_samples(Value grid, Value points, Value deltas, double threshold) {
  const Values out = grid.graph->record(std::make_shared<MarkOccupied>(threshold), {grid, points, deltas});
  return {out[0], out[1], out[2]};
}

}  // namespace vivant
