#include "vivant/graph/launch.hpp"
#include "vivant/ops/rays.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::int64_t camera_columns = 20;

struct RayGeneration final : Op {
  RayGeneration(int width, int height) : width(width), height(height) {}
  std::string_view name() const override { return "ray_generation"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &cameras = in[0].shape, &pixels = in[1].shape;
    if (cameras.rank() != 2 || cameras[1] != camera_columns)
      fail("[ray_generation] cameras must be [frames, {}], they are {}", camera_columns, cameras.text());
    if (in[1].dtype != DType::i32 || pixels.elements() != pixels[0])
      fail("[ray_generation] pixels must be i32 [R], they are {} {}", name_of(in[1].dtype), pixels.text());
    if (width < 1 || height < 1) fail("[ray_generation] images of {}x{} pixels", width, height);
    const TensorType rays{DType::real, {pixels[0], 3}, in[1].count};
    return {rays, rays};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& pixels = launch.in(1);
    launch.kernel("ray_generation.cl", "ray_generation")
        .args(launch.in(0), pixels, launch.out(0), launch.out(1), pixels[0], width, height,
              launch.count_of(pixels))
        .run({static_cast<std::size_t>(pixels[0]), 1, 1}, {64, 1, 1});
  }
  const int width, height;
};

const RegisterOp register_ray_generation({
    .name = "ray_generation",
    .summary = "world rays through pixel centres",
    .inputs = {{"cameras", "[F, 20]"}, {"pixels", "[R]", DType::i32}},
    .outputs = {{"origins", "[R, 3]"}, {"directions", "[R, 3]"}},
    .attributes = {{"width", 1, "pixels of an image"}, {"height", 1, "pixels of an image"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const Rays rays = ray_generation(in[0], in[1], static_cast<int>(a.integer("width")),
                                       static_cast<int>(a.integer("height")));
      return {rays.origins, rays.directions};
    },
});

}  // namespace

Rays ray_generation(Value cameras, Value pixels, int width, int height) {
  const Values out = cameras.graph->record(std::make_shared<RayGeneration>(width, height), {cameras, pixels});
  return {out[0], out[1]};
}

}  // namespace vivant
