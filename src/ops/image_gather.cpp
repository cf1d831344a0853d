#include "vivant/graph/launch.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct ImageGather final : Op {
  std::string_view name() const override { return "image_gather"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &images = in[0].shape, &pixels = in[1].shape;
    if (in[0].dtype != DType::u8 || images.rank() < 2)
      fail("[image_gather] images must be u8 [F, H, W, C], they are {} {}", name_of(in[0].dtype),
           images.text());
    if (in[1].dtype != DType::i32 || pixels.elements() != pixels[0])
      fail("[image_gather] pixels must be i32 [R] or [R, 1], they are {} {}", name_of(in[1].dtype),
           pixels.text());
    return {{DType::real, {pixels[0], images.channels()}, in[1].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& pixels = launch.in(1);
    launch.kernel("image_gather.cl", "image_gather")
        .args(launch.in(0), pixels, launch.out(), pixels[0], launch.in(0).channels(), launch.count_of(pixels))
        .run({static_cast<std::size_t>(pixels[0]), 1, 1}, {64, 1, 1});
  }
};

const RegisterOp register_image_gather({
    .name = "image_gather",
    .summary = "colours in [0, 1] of pixels",
    .inputs = {{"images", "[F, H, W, C]", DType::u8}, {"pixels", "[R]", DType::i32}},
    .outputs = {{"y", "[R, C]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {image_gather(in[0], in[1])};
    },
});

}  // namespace

Value image_gather(Value images, Value pixels) {
  return images.graph->record_one(ImageGather(), {images, pixels});
}

}  // namespace vivant
