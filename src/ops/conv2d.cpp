#include "vivant/ops/conv2d.hpp"

#include "ops/conv2d_weight_gradient.hpp"
#include "ops/pixels.hpp"
#include "ops/tiles.hpp"
#include "ops/winograd.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::int64_t taps = 9;
constexpr std::string_view padding_names[] = {"none", "zero", "reflect"};

void check_window(std::string_view name, const Shape& x, int pad, bool reflect) {
  check_image(name, x);
  if (pad == 0 && std::min(x[0], x[1]) < 3)
    fail("[{}] x {} is smaller than the 3x3 window and there is no padding", name, x.text());
  if (reflect && std::min(x[0], x[1]) < 2)
    fail("[{}] x {} is too small to be mirrored at its border", name, x.text());
}

struct PixelBlock {
  std::int64_t width, height;
};

/// Output pixels that one work-item computes on matrix units: 16 or 32 next to each other, and as many rows
/// of them as leave the staged inputs in the second cache.
PixelBlock pixel_block(std::int64_t channels, std::int64_t out_width) {
  const std::int64_t over = out_width % 32, width = over > 0 && over <= 16 && out_width < 64 ? 16 : 32;
  const std::int64_t staged = (1 << 16) / (packed_rows(channels) * (width + 2)) - 2;
  return {width, std::clamp<std::int64_t>(staged / 2 * 2, width == 16 ? 2 : 1, 8)};
}

/// Inputs: x, w (for its shape and its gradient), b or absent, packed weights (what the kernel reads). `pad`
/// pixels are added on each side. With `transposed` it is the data gradient of the convolution by w.
struct Conv2d final : Op {
  Conv2d(int pad, bool reflect, bool transposed, bool winograd, Activation activation)
      : pad(pad), reflect(reflect), transposed(transposed), winograd(winograd), activation(activation) {}
  std::string_view name() const override { return transposed ? "conv2d_data_gradient" : "conv2d"; }

  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &x = in[0].shape, &w = in[1].shape;
    check_window(name(), x, pad, reflect);
    if (w.rank() != 4 || w[0] != 3 || w[1] != 3)
      fail("[{}] weight {} is neither [3, 3, CI, CO] nor [1, 1, CI, CO]", name(), w.text());
    const std::int64_t inner = w[transposed ? 3 : 2], columns = w[transposed ? 2 : 3];
    if (x.channels() != inner)
      fail("[{}] weight has {} input channels, x has {}", name(), inner, x.channels());
    if (in[2].shape.rank() > 0 && in[2].shape != Shape{columns})
      fail("[{}] bias {} does not fit {} output channels", name(), in[2].shape.text(), columns);
    return {{DType::real, {x[0] + 2 * pad - 2, x[1] + 2 * pad - 2, columns}}};
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real, {in[0].shape.channels()}}};  // zeros: the pixels outside of the image
  }
  Defines defines(const Launch& launch, const Tile& tile) const {
    return {{"INNER", launch.in(0).channels()}, {"PANEL", launch.in(3).channels()},
            {"TILE_ROWS", tile.rows},           {"TILE_VECTORS", tile.vectors},
            {"HAS_BIAS", launch.in(2) ? 1 : 0}, {"ACTIVATION", static_cast<int>(activation)}};
  }
  void launch(Launch& launch) const override {
    if (suits_bf16(launch, launch.in(0).channels()) && (launch.matrix_tiles() || !winograd))
      return launch_bf16(launch);
    // Winograd's last tiles reach beyond the image whatever the padding is.
    if (winograd || (pad > 0 && !reflect)) launch.zero(launch.workspace());
    winograd && !launch.gpu() ? launch_winograd(launch) : launch_taps(launch);
  }
  void launch_bf16(Launch& launch) const {
    const Tensor &x = launch.in(0), &packed = launch.in(3), &y = launch.out();
    const std::int64_t panel = packed.channels(), panels = packed[0];
    const PixelBlock block = pixel_block(x.channels(), y[1]);
    const std::size_t blocks = tiles(y[0], block.height) * tiles(y[1], block.width);
    const bool few = blocks < 16;
    Defines macros = defines(launch, {1, panel / 16});
    macros.emplace_back("BLOCK_WIDTH", block.width);
    macros.emplace_back("BLOCK_HEIGHT", block.height);
    launch.kernel("conv2d.cl", "conv2d_forward_bf16", macros)
        .args(x, packed, launch.in(2), y, x[0], x[1], y[0], y[1], y.channels(), pad, reflect ? 1 : 0,
              few ? 1 : panels)
        .run({blocks, few ? static_cast<std::size_t>(panels) : 1, 1}, {1, 1, 1});
  }
  void launch_winograd(Launch& launch) const {
    const Tensor &x = launch.in(0), &packed = launch.in(3), &y = launch.out();
    const Tile tile = choose_tile(launch, TiledKernel::conv2d_winograd, packed.channels());
    const std::int64_t tiles_of_y = winograd_tiles(y.shape()), panels = packed[0];
    // Transformed inputs and products stay in the second cache, and every core gets work.
    const std::int64_t most = x.channels() <= 128 ? 24 : 12;
    std::int64_t block = most / tile.rows * tile.rows;
    const bool few = tiles_of_y < 8 * block;
    if (few) block = tile.rows;
    Defines macros = defines(launch, tile);
    macros.emplace_back("TILES", block);
    launch.kernel("conv2d_winograd.cl", "conv2d_winograd", macros)
        .args(x, packed, launch.in(2), launch.workspace(), y, x[0], x[1], y[0], y[1], y.channels(), pad,
              reflect ? 1 : 0, few ? 1 : panels)
        .run({tiles(tiles_of_y, block), static_cast<std::size_t>(few ? panels : 1), 1}, {1, 1, 1});
  }
  void launch_taps(Launch& launch) const {
    const Tensor &x = launch.in(0), &packed = launch.in(3), &y = launch.out();
    const Tile tile = choose_tile(launch, TiledKernel::conv2d, packed.channels());
    launch.kernel("conv2d.cl", "conv2d_forward", defines(launch, tile))
        .args(x, packed, launch.in(2), launch.workspace(), y, x[0], x[1], y[0], y[1], y.channels(), pad,
              reflect ? 1 : 0, packed[1])
        .run({tiles(y.rows(), tile.rows), tiles(y.channels(), tile.vectors * launch.vector_width()), 1},
             launch.gpu() ? std::array<std::size_t, 3>{16, 4, 1} : std::array<std::size_t, 3>{1, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override;
  double flops(const TensorTypes& in, const TensorTypes& out) const override {
    return 2.0 * taps * static_cast<double>(out[0].shape.elements() * in[0].shape.channels());
  }
  const int pad;
  const bool reflect, transposed, winograd;
  const Activation activation;
};

/// The convolution of x [H, W, C] by w, or with `transposed` its data gradient, with the algorithm that suits
/// the sizes.
Value convolution(Value x, Value w, Value b, int pad, bool reflect, bool transposed, Activation activation) {
  const bool winograd =
      x.shape().rank() == 3 &&
      suits_winograd(w.shape(), transposed, x.shape()[0] + 2 * pad - 2, x.shape()[1] + 2 * pad - 2);
  return x.graph->record_one(
      Conv2d(pad, reflect, transposed, winograd, activation),
      {x, w, b, winograd ? pack_winograd(w, transposed) : pack_weights(w, transposed)});
}

/// [H+2, W+2, C], the gradient of a mirrored image -> [H, W, C], that of the image.
struct FoldReflection final : Op {
  std::string_view name() const override { return "fold_reflection"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& padded = in[0].shape;
    return {{DType::real, {padded[0] - 2, padded[1] - 2, padded[2]}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& grad = launch.out();
    launch.kernel("conv2d.cl", "fold_reflection")
        .args(launch.in(), grad, grad[0], grad[1], grad[2])
        .run({static_cast<std::size_t>(grad.rows()), 1, 1}, {64, 1, 1});
  }
};

Values Conv2d::gradient(const GradientRequest& request) const {
  if (transposed) return Op::gradient(request);
  const Value x = request.in[0], w = request.in[1];
  const Value grad = activation_gradient(request.out[0], request.grad(), activation);
  Values grads(4);
  if (request.needed[0]) {
    const int gradient_pad = reflect ? 2 : 2 - pad;
    grads[0] = convolution(grad, w, {}, gradient_pad, false, true, Activation::none);
    if (reflect) grads[0] = request.graph.record_one(FoldReflection(), {grads[0]});
  }
  if (request.needed[1]) grads[1] = conv2d_weight_gradient(x, grad, pad, reflect);
  if (request.needed[2]) grads[2] = sum_rows(grad);
  return grads;
}

const RegisterOp register_conv2d({
    .name = "conv2d",
    .summary = "y = f(x * w + b), a 3x3 or 1x1 convolution of stride 1",
    .inputs = {{"x", "[H, W, CI]"},
               {"w", "[3, 3, CI, CO] or [1, 1, CI, CO]"},
               {.name = "b", .shape = "[CO]", .optional = true}},
    .outputs = {{"y", "[H, W, CO]"}},
    .attributes = {{"padding", "zero", "none (the output shrinks), zero or reflect"},
                   {"activation", "none", "none, relu, leaky_relu, softplus, sigmoid or truncated_exp"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {conv2d(in[0], in[1], in[2], padding_from(a.text("padding")),
                     activation_from(a.text("activation")))};
    },
});

}  // namespace

std::string_view name_of(Padding padding) { return padding_names[static_cast<int>(padding)]; }

Padding padding_from(const std::string& name) {
  for (int i = 0; i < static_cast<int>(std::size(padding_names)); ++i)
    if (padding_names[i] == name) return static_cast<Padding>(i);
  throw UsageError(fmt::format("unknown padding '{}': use none, zero or reflect", name));
}

Value conv2d(Value x, Value w, Value b, Padding padding, Activation activation) {
  if (w.shape().rank() == 4 && w.shape()[0] == 1 && w.shape()[1] == 1)
    return linear(x, w.graph->reshape(w, {w.shape()[2], w.shape()[3]}), b, activation);
  const bool reflect = padding == Padding::reflect;
  return convolution(x, w, b, padding == Padding::none ? 0 : 1, reflect, false, activation);
}

}  // namespace vivant
