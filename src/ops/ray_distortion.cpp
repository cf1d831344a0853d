#include "vivant/ops/ray_distortion.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

std::array<std::size_t, 3> ray_items(const Tensor& weight) {
  return {static_cast<std::size_t>(weight[0]), 1, 1};
}
std::array<std::size_t, 3> ray_group(const Launch& launch) {
  return {launch.gpu() ? std::size_t{64} : 1, 1, 1};
}

/// Inputs: weight, depths, near, far, the gradient of the distortion.
struct RayDistortionGradient final : Op {
  explicit RayDistortionGradient(Spacing spacing) : spacing(spacing) {}
  std::string_view name() const override { return "ray_distortion_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  void launch(Launch& launch) const override {
    const Tensor& weight = launch.in(0);
    launch.kernel("ray_distortion.cl", "ray_distortion_gradient", {{"SPACING", static_cast<int>(spacing)}})
        .args(weight, launch.in(1), launch.in(2), launch.in(3), launch.in(4), launch.out(), weight[0],
              weight[1])
        .run(ray_items(weight), ray_group(launch));
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 26.0 * static_cast<double>(in[0].shape.elements());
  }
  const Spacing spacing;
};

/// Inputs: weight, depths, near, far.
struct RayDistortion final : Op {
  explicit RayDistortion(Spacing spacing) : spacing(spacing) {}
  std::string_view name() const override { return "ray_distortion"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& weight = in[0].shape;
    if (weight.rank() != 2 || in[1].shape != weight)
      fail("[ray_distortion] weight and depths must be [R, S], they are {} and {}", weight.text(),
           in[1].shape.text());
    for (int i : {2, 3})
      if (in[i].shape.elements() != weight[0])
        fail("[ray_distortion] near and far must be [R, 1], they are {} and {}", in[2].shape.text(),
             in[3].shape.text());
    return {{DType::real, {weight[0], 1}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& weight = launch.in(0);
    launch.kernel("ray_distortion.cl", "ray_distortion", {{"SPACING", static_cast<int>(spacing)}})
        .args(weight, launch.in(1), launch.in(2), launch.in(3), launch.out(), weight[0], weight[1])
        .run(ray_items(weight), ray_group(launch));
  }
  Values gradient(const GradientRequest& request) const override {
    const Values& in = request.in;
    if (request.needed[1] || request.needed[2] || request.needed[3])
      fail("[ray_distortion] has no gradient to depths, near and far: detach them");
    Values grads(4);
    grads[0] = request.graph.record_one(RayDistortionGradient(spacing),
                                        {in[0], in[1], in[2], in[3], request.grad()});
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 14.0 * static_cast<double>(in[0].shape.elements());
  }
  const Spacing spacing;
};

const RegisterOp register_ray_distortion({
    .name = "ray_distortion",
    .summary = "how far the weight of each ray is spread over its samples",
    .inputs = {{"weight", "[R, S]"}, {"depths", "[R, S]"}, {"near", "[R, 1]"}, {"far", "[R, 1]"}},
    .outputs = {{"y", "[R, 1]"}},
    .attributes = {{"spacing", "linear", "linear or disparity"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {ray_distortion(in[0], in[1], in[2], in[3], spacing_from(a.text("spacing")))};
    },
});

}  // namespace

Value ray_distortion(Value weight, Value depths, Value near, Value far, Spacing spacing) {
  return weight.graph->record_one(RayDistortion(spacing), {weight, depths, near, far});
}

}  // namespace vivant
