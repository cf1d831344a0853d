#include "ops/partials.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/rays.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

enum Input { origins, directions, pixels, corrections, grad_origins, grad_directions };

constexpr std::int64_t shortest_chunk = 128, most_chunks = 64;

struct RayCorrectionGradient final : Op {
  RayCorrectionGradient(std::int64_t frame_pixels, double unit) : frame_pixels(frame_pixels), unit(unit) {}
  std::string_view name() const override { return "ray_correction_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {{DType::real, in[corrections].shape}}; }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real,
             {chunks_of(in[directions].shape[0], shortest_chunk, most_chunks),
              in[corrections].shape.elements()}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &d = launch.in(directions), &partial = launch.workspace();
    launch.kernel("ray_correction.cl", "ray_correction_partials")
        .args(d, launch.in(pixels), launch.in(corrections), launch.in(grad_origins),
              launch.in(grad_directions), partial, d[0], launch.in(corrections)[0], frame_pixels, unit,
              chunk_length(d[0], shortest_chunk, most_chunks), launch.count_of(d))
        .run({static_cast<std::size_t>(partial[0]), 1, 1}, {1, 1, 1});
    reduce_partials(launch, partial, launch.out(), partial[0], partial[1]);
  }
  const std::int64_t frame_pixels;
  const double unit;
};

struct RayCorrection final : Op {
  RayCorrection(std::int64_t frame_pixels, double unit) : frame_pixels(frame_pixels), unit(unit) {}
  std::string_view name() const override { return "ray_correction"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &d = in[directions].shape, &pixel = in[pixels].shape, &correction = in[corrections].shape;
    if (d.rank() != 2 || d[1] != 3 || in[origins].shape != d)
      fail("[ray_correction] origins {} and directions {} are not both [R, 3]", in[origins].shape.text(),
           d.text());
    if (in[pixels].dtype != DType::i32 || pixel[0] != d[0] || pixel.elements() != d[0])
      fail("[ray_correction] pixels must be i32 [{}], they are {} {}", d[0], name_of(in[pixels].dtype),
           pixel.text());
    if (correction.rank() != 2 || correction[1] != 6)
      fail("[ray_correction] corrections must be [frames, 6], they are {}", correction.text());
    if (frame_pixels < 1) fail("[ray_correction] frames of {} pixels", frame_pixels);
    return {in[origins], in[directions]};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& d = launch.in(directions);
    launch.kernel("ray_correction.cl", "ray_correction")
        .args(launch.in(origins), d, launch.in(pixels), launch.in(corrections), launch.out(0), launch.out(1),
              d[0], frame_pixels, unit, launch.count_of(d))
        .run({static_cast<std::size_t>(d[0]), 1, 1}, {64, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    Values in = request.in;
    in.push_back(request.grad(0));
    in.push_back(request.grad(1));
    Values grads(request.in.size());
    if (request.needed[corrections])
      grads[corrections] = request.graph.record_one(RayCorrectionGradient(frame_pixels, unit), in);
    return grads;
  }
  const std::int64_t frame_pixels;
  const double unit;
};

const RegisterOp register_ray_correction({
    .name = "ray_correction",
    .summary = "rays of cameras that are turned and moved a little, by frame",
    .inputs = {{"origins", "[R, 3]"},
               {"directions", "[R, 3]"},
               {"pixels", "[R]", DType::i32},
               {"corrections", "[F, 6]"}},
    .outputs = {{"origins", "[R, 3]"}, {"directions", "[R, 3]"}},
    .attributes = {{"frame_pixels", 1, "pixels of a frame"}, {"unit", 1.0, "length of a translation of 1"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const Rays rays =
          ray_correction({in[0], in[1]}, in[2], in[3], a.integer("frame_pixels"), a.number("unit"));
      return {rays.origins, rays.directions};
    },
});

}  // namespace

Rays ray_correction(const Rays& rays, Value pixels, Value corrections, std::int64_t frame_pixels,
                    double unit) {
  const Values out = corrections.graph->record(std::make_shared<RayCorrection>(frame_pixels, unit),
                                               {rays.origins, rays.directions, pixels, corrections});
  return {out[0], out[1]};
}

}  // namespace vivant
