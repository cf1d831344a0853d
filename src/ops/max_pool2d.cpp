#include "vivant/ops/max_pool2d.hpp"

#include "ops/pixels.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct MaxPool2dGradient final : Op {
  std::string_view name() const override { return "max_pool2d_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &grad_y = launch.in(1);
    auto call = launch.kernel("max_pool2d.cl", "max_pool2d_gradient", {{"LANES", lanes_of(launch, x[2])}});
    call.args(x, grad_y, launch.out(), x[0], x[1], grad_y[0], grad_y[1], x[2]);
    run_over_pixels(call, launch, (x[0] + 1) / 2, (x[1] + 1) / 2, x[2]);
  }
};

struct MaxPool2d final : Op {
  explicit MaxPool2d(bool ceil) : ceil(ceil) {}
  std::string_view name() const override { return "max_pool2d"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& x = in[0].shape;
    check_image(name(), x);
    const std::int64_t up = ceil ? 1 : 0;
    if (std::min(x[0], x[1]) + up < 2) fail("[max_pool2d] x {} is smaller than the 2x2 window", x.text());
    return {{DType::real, {(x[0] + up) / 2, (x[1] + up) / 2, x[2]}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &y = launch.out();
    auto call = launch.kernel("max_pool2d.cl", "max_pool2d", {{"LANES", lanes_of(launch, x[2])}});
    call.args(x, y, x[0], x[1], y[0], y[1], x[2]);
    run_over_pixels(call, launch, y[0], y[1], y[2]);
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(MaxPool2dGradient(), {request.in[0], request.grad()})};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
  const bool ceil;
};

const RegisterOp register_max_pool2d({
    .name = "max_pool2d",
    .summary = "the largest value of each 2x2 window",
    .inputs = {{"x", "[H, W, C]"}},
    .outputs = {{"y", "[H/2, W/2, C]"}},
    .attributes = {{"ceil", false, "round odd extents up, not down"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {max_pool2d(in[0], a.flag("ceil"))};
    },
});

}  // namespace

Value max_pool2d(Value x, bool ceil) { return x.graph->record_one(MaxPool2d(ceil), {x}); }

}  // namespace vivant
