#include "vivant/ops/plane_variation.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

double scale_of(const Shape& planes) { return 1.0 / static_cast<double>(planes.elements()); }

std::array<std::size_t, 3> rows_of(const Tensor& planes) {
  return {static_cast<std::size_t>(planes[0] * planes[1]), 1, 1};
}

/// Inputs: planes, the gradient of the variation.
struct PlaneVariationGradient final : Op {
  std::string_view name() const override { return "plane_variation_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("plane_variation.cl", "plane_variation_gradient")
        .args(x, launch.in(1), launch.out(), x[0] * x[1], x[1], x[2], x[3], scale_of(x.shape()))
        .run(rows_of(x), {1, 1, 1});
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 6.0 * static_cast<double>(in[0].shape.elements());
  }
};

struct PlaneVariation final : Op {
  std::string_view name() const override { return "plane_variation"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& planes = in[0].shape;
    if (planes.rank() != 4)
      fail("[plane_variation] the planes must be [P, H, W, C], they are {}", planes.text());
    return {{DType::real, {1}}};
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real, {in[0].shape[0] * in[0].shape[1]}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &partial = launch.workspace();
    launch.kernel("plane_variation.cl", "plane_variation_rows")
        .args(x, partial, x[0] * x[1], x[1], x[2], x[3])
        .run(rows_of(x), {1, 1, 1});
    launch.kernel("plane_variation.cl", "plane_variation_sum")
        .args(partial, launch.out(), x[0] * x[1], scale_of(x.shape()))
        .run({1, 1, 1}, {1, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(PlaneVariationGradient(), {request.in[0], request.grad()})};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 6.0 * static_cast<double>(in[0].shape.elements());
  }
};

const RegisterOp register_plane_variation({
    .name = "plane_variation",
    .summary = "the mean squared difference of neighbouring cells of planes",
    .inputs = {{"planes", "[P, H, W, C]"}},
    .outputs = {{"y", "[1]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values { return {plane_variation(in[0])}; },
});

}  // namespace

Value plane_variation(Value planes) { return planes.graph->record_one(PlaneVariation(), {planes}); }

}  // namespace vivant
