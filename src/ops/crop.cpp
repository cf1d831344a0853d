#include "ops/pixels.hpp"
#include "vivant/ops/registry.hpp"
#include "vivant/ops/resample.hpp"

namespace vivant {
namespace {

struct Window {
  std::int64_t y, x, height, width;
};

struct CropGradient final : Op {
  CropGradient(Shape shape, Window window) : shape(std::move(shape)), window(window) {}
  std::string_view name() const override { return "crop_gradient"; }
  TensorTypes infer(const TensorTypes&) const override { return {{DType::real, shape}}; }
  void launch(Launch& launch) const override {
    auto call = launch.kernel("crop.cl", "crop_gradient");
    call.args(launch.in(0), launch.out(), shape[0], shape[1], window.y, window.x, window.height, window.width,
              shape[2]);
    run_over_pixels(call, launch, shape[0], shape[1], shape[2]);
  }
  const Shape shape;
  const Window window;
};

struct Crop final : Op {
  Crop(Window window, bool replicate) : window(window), replicate(replicate) {}
  std::string_view name() const override { return "crop"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& x = in[0].shape;
    check_image(name(), x);
    const bool inside =
        window.y >= 0 && window.x >= 0 && window.y + window.height <= x[0] && window.x + window.width <= x[1];
    if (!inside && !replicate)
      fail("[crop] the window {}x{} at ({}, {}) reaches beyond {}", window.height, window.width, window.y,
           window.x, x.text());
    return {{DType::real, {window.height, window.width, x[2]}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    auto call = launch.kernel("crop.cl", "crop");
    call.args(x, launch.out(), x[0], x[1], window.y, window.x, window.height, window.width, x[2]);
    run_over_pixels(call, launch, window.height, window.width, x[2]);
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(CropGradient(request.in[0].shape(), window), {request.grad()})};
  }
  const Window window;
  const bool replicate;
};

const RegisterOp register_crop({
    .name = "crop",
    .summary = "a window of an image",
    .inputs = {{"image", "[H, W, C]"}},
    .outputs = {{"y", "[height, width, C]"}},
    .attributes = {{"y", 0, "first row"},
                   {"x", 0, "first column"},
                   {"height", 1, "rows"},
                   {"width", 1, "columns"},
                   {"replicate", false, "repeat edge pixels beyond the border"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {crop(in[0], a.integer("y"), a.integer("x"), a.integer("height"), a.integer("width"),
                   a.flag("replicate"))};
    },
});

}  // namespace

Value crop(Value image, std::int64_t y, std::int64_t x, std::int64_t height, std::int64_t width,
           bool replicate) {
  return image.graph->record_one(Crop({y, x, height, width}, replicate), {image});
}

}  // namespace vivant
