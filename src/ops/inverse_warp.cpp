#include "vivant/ops/inverse_warp.hpp"

#include "ops/partials.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr const char* file = "inverse_warp.cl";
constexpr std::array<std::size_t, 3> row_group{64, 1, 1};

std::array<std::size_t, 3> row_items(const Tensor& x) { return {static_cast<std::size_t>(x[0]), 1, 1}; }

Defines defines(const Launch& launch) {
  return {{"HAS_DIRECTIONS", launch.in(1) ? 1 : 0}, {"ENTRIES", launch.gpu() ? 1 : 12}};
}

/// Inputs: those of InverseWarp, then the gradients of points and directions. Outputs: the gradients of
/// points and, when there are any, directions.
struct InverseWarpGradient final : Op {
  std::string_view name() const override { return "inverse_warp_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override {
    TensorTypes out = {in[0]};
    if (in[1].shape.rank() > 0) out.push_back(in[0]);
    return out;
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& points = launch.in(0);
    launch.kernel(file, "inverse_warp_gradient", defines(launch))
        .args(points, launch.in(1), launch.in(2), launch.in(3), launch.in(4), launch.in(5), launch.in(6),
              launch.in(7), launch.out(0), launch.in(1) ? launch.out(1) : Tensor{}, points[0],
              launch.count_of(points))
        .run(row_items(points), row_group);
  }
};

/// The same inputs. Output: the gradient of transforms.
struct WarpTransformGradient final : Op {
  std::string_view name() const override { return "warp_transform_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[5]}; }
  static std::int64_t chunk_rows(const TensorTypes& in) { return chunk_length(in[0].shape[0], 1024, 16); }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real, {chunks_of(in[0].shape[0], 1024, 16), in[5].shape.elements()}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &points = launch.in(0), &partial = launch.workspace();
    const std::size_t owners = launch.gpu() ? 12 : 1;
    launch.kernel(file, "warp_transform_partials", defines(launch))
        .args(points, launch.in(1), launch.in(2), launch.in(3), launch.in(4), launch.in(5), launch.in(6),
              launch.in(7), partial, launch.out()[0], chunk_length(points[0], 1024, 16), points[0],
              launch.count_of(points))
        .run({static_cast<std::size_t>(partial[0]), owners, 1}, {1, 1, 1});
    reduce_partials(launch, partial, launch.out(), partial[0], partial[1]);
  }
};

/// Inputs: points, directions or absent, faces, barycentric, triangles, transforms.
struct InverseWarp final : Op {
  std::string_view name() const override { return "inverse_warp"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& points = in[0].shape;
    if (points.rank() != 2 || points[1] != 3) fail("[inverse_warp] points {} are not [N, 3]", points.text());
    const bool directions = in[1].shape.rank() > 0;
    if (directions && in[1].shape != points)
      fail("[inverse_warp] directions {} do not fit points {}", in[1].shape.text(), points.text());
    if (in[2].shape != Shape{points[0], 1} || in[2].dtype != DType::i32)
      fail("[inverse_warp] faces are {} {}, not i32 [{}, 1]", name_of(in[2].dtype), in[2].shape.text(),
           points[0]);
    if (in[3].shape != points)
      fail("[inverse_warp] barycentric {} does not fit points {}", in[3].shape.text(), points.text());
    if (in[4].dtype != DType::i32 || in[4].shape.rank() != 2 || in[4].shape[1] != 3)
      fail("[inverse_warp] triangles are {} {}, not i32 [F, 3]", name_of(in[4].dtype), in[4].shape.text());
    if (in[5].shape.rank() != 2 || in[5].shape[1] != 12)
      fail("[inverse_warp] transforms {} are not [V, 12]", in[5].shape.text());
    TensorTypes out = {{DType::real, points, in[0].count}, {DType::real, {points[0], 1}, in[0].count}};
    if (directions) out.push_back(out[0]);
    return out;
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& points = launch.in(0);
    launch.kernel(file, "inverse_warp", defines(launch))
        .args(points, launch.in(1), launch.in(2), launch.in(3), launch.in(4), launch.in(5), launch.out(0),
              launch.out(1), launch.in(1) ? launch.out(2) : Tensor{}, no_canonical_point, points[0],
              launch.count_of(points))
        .run(row_items(points), row_group);
  }
  Values gradient(const GradientRequest& request) const override {
    Values in = request.in;
    in.push_back(request.grad(0));
    in.push_back(in[1] ? request.grad(2) : Value{});
    Values grads(6);
    if (request.needed[0] || request.needed[1]) {
      const Values both = request.graph.record(std::make_shared<InverseWarpGradient>(), in);
      grads[0] = both[0];
      if (in[1]) grads[1] = both[1];
    }
    if (request.needed[5]) grads[5] = request.graph.record_one(WarpTransformGradient(), in);
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 150.0 * static_cast<double>(in[0].shape[0]);
  }
};

const RegisterOp register_inverse_warp({
    .name = "inverse_warp",
    .summary = "from observation to canonical space, by the inverse of the closest point's blended transform",
    .inputs = {{"points", "[N, 3]"},
               {.name = "directions", .shape = "[N, 3]", .optional = true},
               {"faces", "[N, 1]", DType::i32},
               {"barycentric", "[N, 3]"},
               {"triangles", "[F, 3]", DType::i32},
               {"transforms", "[V, 12]"}},
    .outputs = {{"points", "[N, 3]"},
                {"inside", "[N, 1]"},
                {.name = "directions", .shape = "[N, 3]", .optional = true}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      const CanonicalSamples samples = inverse_warp(in[0], in[1], in[2], in[3], in[4], in[5]);
      Values out = {samples.points, samples.inside};
      if (samples.directions) out.push_back(samples.directions);
      return out;
    },
});

}  // namespace

CanonicalSamples inverse_warp(Value points, Value directions, Value faces, Value barycentric, Value triangles,
                              Value transforms) {
  const Values out = points.graph->record(std::make_shared<InverseWarp>(),
                                          {points, directions, faces, barycentric, triangles, transforms});
  return {out[0], out[1], directions ? out[2] : Value{}};
}

}  // namespace vivant
