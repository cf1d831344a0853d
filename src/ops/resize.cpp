#include <algorithm>

#include "ops/pixels.hpp"
#include "vivant/ops/registry.hpp"
#include "vivant/ops/resample.hpp"

namespace vivant {
namespace {

/// x [H, W, C] -> [height, width, C], or with `adjoint` the gradient: [H2, W2, C] -> [height, width, C].
struct ResizeBilinear final : Op {
  ResizeBilinear(std::int64_t height, std::int64_t width, bool adjoint)
      : height(height), width(width), adjoint(adjoint) {}
  std::string_view name() const override { return adjoint ? "resize_gradient" : "resize_bilinear"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& x = in[0].shape;
    check_image(name(), x);
    constexpr std::int64_t most = 16384;  // positions are integers over twice the product of both extents
    if (std::max({x[0], x[1], height, width}) > most)
      fail("[{}] {} to {}x{}: images have at most {} pixels a side", name(), x.text(), height, width, most);
    return {{DType::real, {height, width, x[2]}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &y = launch.out(), &small = adjoint ? y : x, &large = adjoint ? x : y;
    auto call = launch.kernel("resize.cl", adjoint ? "resize_gradient" : "resize");
    call.args(x, y, small[0], small[1], large[0], large[1], x[2]);
    run_over_pixels(call, launch, y[0], y[1], y[2]);
  }
  Values gradient(const GradientRequest& request) const override {
    const Shape& x = request.in[0].shape();
    return {request.graph.record_one(ResizeBilinear(x[0], x[1], !adjoint), {request.grad()})};
  }
  double flops(const TensorTypes& in, const TensorTypes& out) const override {
    return 8.0 * static_cast<double>((adjoint ? in : out)[0].shape.elements());
  }
  const std::int64_t height, width;
  const bool adjoint;
};

const RegisterOp register_resize({
    .name = "resize_bilinear",
    .summary = "an image at another size",
    .inputs = {{"x", "[H, W, C]"}},
    .outputs = {{"y", "[height, width, C]"}},
    .attributes = {{"height", 1, "rows of y"}, {"width", 1, "columns of y"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {resize_bilinear(in[0], a.integer("height"), a.integer("width"))};
    },
});

}  // namespace

Value resize_bilinear(Value x, std::int64_t height, std::int64_t width) {
  return x.graph->record_one(ResizeBilinear(height, width, false), {x});
}

}  // namespace vivant
