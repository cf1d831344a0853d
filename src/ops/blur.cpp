#include <cmath>

#include "ops/pixels.hpp"
#include "ops/rows.hpp"
#include "vivant/ops/registry.hpp"
#include "vivant/ops/resample.hpp"

namespace vivant {
namespace {

/// Inputs: x [H, W, C], taps [radius + 1].
struct BlurAxis final : Op {
  BlurAxis(int axis, bool adjoint) : axis(axis), adjoint(adjoint) {}
  std::string_view name() const override { return adjoint ? "blur_axis_gradient" : "blur_axis"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& x = in[0].shape;
    check_image("gaussian_blur", x);
    if (x[axis] < in[1].shape.elements())
      fail("[gaussian_blur] {} is too small for a radius of {} pixels", x.text(), in[1].shape.elements() - 1);
    return {in[0]};
  }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &taps = launch.in(1);
    const std::int64_t outer = axis == 0 ? 1 : x[0], inner = axis == 0 ? x[1] * x[2] : x[2];
    launch.kernel("blur.cl", "blur_axis")
        .args(x, taps, launch.out(), outer, x[axis], inner, taps.elements() - 1, adjoint ? 1 : 0)
        .run({vectors(launch, x[axis] * inner)[0], static_cast<std::size_t>(outer), 1}, {16, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(BlurAxis(axis, !adjoint), {request.grad(), request.in[1]}), Value{}};
  }
  double flops(const TensorTypes& in, const TensorTypes& out) const override {
    return 3.0 * static_cast<double>(out[0].shape.elements() * in[1].shape.elements());
  }
  const int axis;
  const bool adjoint;
};

const RegisterOp register_blur({
    .name = "gaussian_blur",
    .summary = "an image convolved with a Gaussian, borders reflected",
    .inputs = {{"x", "[H, W, C]"}},
    .outputs = {{"y", "[H, W, C]"}},
    .attributes = {{"sigma", 1.0, "standard deviation in pixels"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {gaussian_blur(in[0], a.number("sigma"))};
    },
});

}  // namespace

Value gaussian_blur(Value x, double sigma) {
  if (!(sigma > 0)) fail("[gaussian_blur] sigma must be positive, it is {}", sigma);
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> taps;
  double sum = 0;
  for (int d = 0; d <= radius; ++d) {
    taps.push_back(std::exp(-0.5 * d * d / (sigma * sigma)));
    sum += (d == 0 ? 1 : 2) * taps.back();
  }
  for (double& tap : taps) tap /= sum;
  const Value weights = x.graph->constant({radius + 1}, std::span<const double>(taps));
  const Value down = x.graph->record_one(BlurAxis(0, false), {x, weights});
  return x.graph->record_one(BlurAxis(1, false), {down, weights});
}

}  // namespace vivant
