#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"
#include "vivant/ops/volume_render.hpp"

namespace vivant {
namespace {

std::array<std::size_t, 3> ray_items(const Tensor& density) {
  return {static_cast<std::size_t>(density[0]), 1, 1};
}
std::array<std::size_t, 3> ray_group(const Launch& launch) {
  return {launch.gpu() ? std::size_t{64} : 1, 1, 1};
}

/// Inputs: density, delta, depths, weight, and the gradients of weight, alpha and depth, each absent or not.
struct WeightsGradient final : Op {
  std::string_view name() const override { return "render_weights_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {{DType::real, in[0].shape}}; }
  void launch(Launch& launch) const override {
    const Tensor& density = launch.in(0);
    launch.kernel("render_weights.cl", "render_weights_gradient")
        .args(density, launch.in(1), launch.in(2), launch.in(3), launch.in(4), launch.in(5), launch.in(6),
              launch.out(), density[0], density[1])
        .run(ray_items(density), ray_group(launch));
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 11.0 * static_cast<double>(in[0].shape.elements());  // the exponential not counted
  }
};

struct Weights final : Op {
  std::string_view name() const override { return "render_weights"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& density = in[0].shape;
    if (density.rank() != 2)
      fail("[render_weights] density must be [rays, samples], it is {}", density.text());
    for (std::size_t i : {1, 2})
      if (in[i].shape != density)
        fail("[render_weights] {} is {}, density {}", i == 1 ? "delta" : "depths", in[i].shape.text(),
             density.text());
    const Shape per_ray{density[0], 1};
    return {{DType::real, density}, {DType::real, per_ray}, {DType::real, per_ray}};
  }
  void launch(Launch& launch) const override {
    const Tensor& density = launch.in(0);
    launch.kernel("render_weights.cl", "render_weights")
        .args(density, launch.in(1), launch.in(2), launch.out(0), launch.out(1), launch.out(2), density[0],
              density[1])
        .run(ray_items(density), ray_group(launch));
  }
  Values gradient(const GradientRequest& request) const override {
    const Values &in = request.in, &grads = request.grad_out;
    if (request.needed[1] || request.needed[2])
      fail("[render_weights] has no gradient to delta and depths: detach them");
    return {request.graph.record_one(WeightsGradient(),
                                     {in[0], in[1], in[2], request.out[0], grads[0], grads[1], grads[2]}),
            Value{}, Value{}};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 6.0 * static_cast<double>(in[0].shape.elements());  // the two exponentials not counted
  }
};

const RegisterOp register_render_weights({
    .name = "render_weights",
    .summary = "the weights, the alpha and the depth of rays from the densities of their samples",
    .inputs = {{"density", "[R, S]"}, {"delta", "[R, S]"}, {"depths", "[R, S]"}},
    .outputs = {{"weight", "[R, S]"}, {"alpha", "[R, 1]"}, {"depth", "[R, 1]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      const RenderWeights rendered = render_weights(in[0], in[1], in[2]);
      return {rendered.weight, rendered.alpha, rendered.depth};
    },
});

const RegisterOp register_volume_render({
    .name = "volume_render",
    .summary = "features, alpha and depth of rays: render_weights, then weighted_sum",
    .inputs = {{"density", "[R, S]"},
               {"delta", "[R, S]"},
               {"depths", "[R, S]"},
               {"feature", "[R * S, C] or [R, S, C]"}},
    .outputs = {{"feature", "[R, C]"}, {"alpha", "[R, 1]"}, {"depth", "[R, 1]"}, {"weight", "[R, S]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      const Rendered rendered = volume_render(in[0], in[1], in[2], in[3]);
      return {rendered.feature, rendered.alpha, rendered.depth, rendered.weight};
    },
});

}  // namespace

RenderWeights render_weights(Value density, Value delta, Value depths) {
  const Values out = density.graph->record(std::make_shared<Weights>(), {density, delta, depths});
  return {out[0], out[1], out[2]};
}

Rendered volume_render(Value density, Value delta, Value depths, Value feature) {
  const RenderWeights rendered = render_weights(density, delta, depths);
  return {feature ? weighted_sum(rendered.weight, feature) : Value{}, rendered.alpha, rendered.depth,
          rendered.weight};
}

}  // namespace vivant
