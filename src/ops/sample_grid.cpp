#include "vivant/ops/sample_grid.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct SampleGrid final : Op {
  SampleGrid(const Eigen::Vector3d& low, const Eigen::Vector3d& high) : low(low), high(high) {}
  std::string_view name() const override { return "sample_grid"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.rank() != 3) fail("[sample_grid] the grid {} is not [D, H, W]", in[0].shape.text());
    if (in[1].shape.rank() != 2 || in[1].shape[1] != 3)
      fail("[sample_grid] points {} are not [N, 3]", in[1].shape.text());
    if (!((high - low).minCoeff() > 0)) fail("[sample_grid] the box is empty");
    return {{DType::real, {in[1].shape[0], 1}, in[1].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &grid = launch.in(0), &points = launch.in(1);
    const auto scale = [&](int axis) {
      return static_cast<double>(grid[2 - axis] - 1) / (high[axis] - low[axis]);
    };
    launch.kernel("sample_grid.cl", "sample_grid")
        .args(grid, points, launch.out(), low[0], low[1], low[2], scale(0), scale(1), scale(2), grid[0],
              grid[1], grid[2], points[0], launch.count_of(points))
        .run({static_cast<std::size_t>(points[0]), 1, 1}, {64, 1, 1});
  }
  Values gradient(const GradientRequest&) const override { return Values(2); }
  const Eigen::Vector3d low, high;
};

const RegisterOp registration({
    .name = "sample_grid",
    .summary = "trilinear samples of a grid over a box",
    .inputs = {{"grid", "[D, H, W]"}, {"points", "[N, 3]"}},
    .outputs = {{"y", "[N, 1]"}},
    .attributes = {{"low", -1.0, "lower corner of the box, the same on every axis"},
                   {"high", 1.0, "upper corner of the box"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {sample_grid(in[0], in[1], Eigen::Vector3d::Constant(a.number("low")),
                          Eigen::Vector3d::Constant(a.number("high")))};
    },
});

}  // namespace

Value sample_grid(Value grid, Value points, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return grid.graph->record_one(SampleGrid(low, high), {grid, points});
}

}  // namespace vivant
