#include "vivant/ops/upsample.hpp"

#include "ops/pixels.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/registry.hpp"
#include "vivant/ops/resample.hpp"

namespace vivant {
namespace {

/// One of the rearrangements of upsample.cl; they come in pairs, each the gradient of the other.
enum class Rearrangement { depth_to_space, space_to_depth, repeat_blocks, sum_blocks, swap_axes };
constexpr std::string_view rearrangement_names[] = {"depth_to_space", "space_to_depth", "repeat_blocks",
                                                    "sum_blocks", "swap_axes"};
constexpr Rearrangement gradient_of[] = {Rearrangement::space_to_depth, Rearrangement::depth_to_space,
                                         Rearrangement::sum_blocks, Rearrangement::repeat_blocks,
                                         Rearrangement::swap_axes};

struct Rearrange final : Op {
  explicit Rearrange(Rearrangement kind) : kind(kind) {}
  std::string_view name() const override { return rearrangement_names[static_cast<int>(kind)]; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& x = in[0].shape;
    check_image(name(), x);
    switch (kind) {
      case Rearrangement::depth_to_space:
        if (x[2] % 4 != 0) fail("[depth_to_space] the channels of x {} are not a multiple of 4", x.text());
        return {{DType::real, {2 * x[0], 2 * x[1], x[2] / 4}}};
      case Rearrangement::space_to_depth:
        return {{DType::real, {x[0] / 2, x[1] / 2, 4 * x[2]}}};
      case Rearrangement::repeat_blocks:
        return {{DType::real, {2 * x[0], 2 * x[1], x[2]}}};
      case Rearrangement::sum_blocks:
        return {{DType::real, {x[0] / 2, x[1] / 2, x[2]}}};
      case Rearrangement::swap_axes:
        break;
    }
    return {{DType::real, {x[1], x[0], x[2]}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &y = launch.out();
    const bool shrinks = kind == Rearrangement::space_to_depth || kind == Rearrangement::sum_blocks;
    const bool over_small = kind == Rearrangement::sum_blocks || kind == Rearrangement::swap_axes;
    const Tensor &small = shrinks ? y : x, &counted = over_small ? small : shrinks ? x : y;
    const std::int64_t channels = std::min(x[2], y[2]);
    auto call = launch.kernel("upsample.cl", std::string(name()), {{"LANES", lanes_of(launch, channels)}});
    call.args(x, y, small[0], small[1], channels);
    run_over_pixels(call, launch, counted[0], counted[1], channels);
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(Rearrange(gradient_of[static_cast<int>(kind)]), {request.grad()})};
  }
  const Rearrangement kind;
};

Value rearrange(Value x, Rearrangement kind) { return x.graph->record_one(Rearrange(kind), {x}); }

const RegisterOp register_upsample({
    .name = "upsample2x",
    .summary = "an image of twice the size",
    .inputs = {{"x", "[H, W, C]"}},
    .outputs = {{"y", "[2H, 2W, C]"}},
    .attributes = {{"mode", "nearest", "nearest or bilinear"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {upsample2x(in[0], upsampling_from(a.text("mode")))};
    },
});
const RegisterOp register_depth_to_space({
    .name = "depth_to_space",
    .summary = "four groups of channels as 2x2 blocks of pixels",
    .inputs = {{"x", "[H, W, 4C]"}},
    .outputs = {{"y", "[2H, 2W, C]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values { return {depth_to_space(in[0])}; },
});
const RegisterOp register_transposed_conv2d({
    .name = "transposed_conv2d",
    .summary = "the transposed 2x2 convolution of stride 2",
    .inputs = {{"x", "[H, W, CI]"},
               {"w", "[2, 2, CI, CO]"},
               {.name = "b", .shape = "[CO]", .optional = true}},
    .outputs = {{"y", "[2H, 2W, CO]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {transposed_conv2d(in[0], in[1], in[2])};
    },
});

}  // namespace

Upsampling upsampling_from(const std::string& name) {
  if (name == "nearest") return Upsampling::nearest;
  if (name == "bilinear") return Upsampling::bilinear;
  throw UsageError(fmt::format("unknown upsampling '{}': use nearest or bilinear", name));
}

Value upsample2x(Value x, Upsampling upsampling) {
  check_image("upsample2x", x.shape());
  if (upsampling == Upsampling::bilinear) return resize_bilinear(x, 2 * x.shape()[0], 2 * x.shape()[1]);
  return rearrange(x, Rearrangement::repeat_blocks);
}

Value depth_to_space(Value x) { return rearrange(x, Rearrangement::depth_to_space); }

Value transposed_conv2d(Value x, Value w, Value b) {
  const Shape& shape = w.shape();
  check_image("transposed_conv2d", x.shape());
  if (shape.rank() != 4 || shape[0] != 2 || shape[1] != 2 || shape[2] != x.shape()[2])
    fail("[transposed_conv2d] weight {} is not [2, 2, {}, CO]", shape.text(), x.shape()[2]);
  const std::int64_t inner = shape[2], columns = shape[3];
  if (b && b.shape() != Shape{columns})
    fail("[transposed_conv2d] bias {} does not fit {} output channels", b.shape().text(), columns);
  Graph& graph = *x.graph;
  const Value swapped = rearrange(graph.reshape(w, {4, inner, columns}), Rearrangement::swap_axes);
  const Value bias = b ? graph.reshape(broadcast_row(b, {4, columns}), {4 * columns}) : Value{};
  return depth_to_space(linear(x, graph.reshape(swapped, {inner, 4 * columns}), bias));
}

}  // namespace vivant
