#include "vivant/ops/linear.hpp"

#include "ops/partials.hpp"
#include "ops/tiles.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// y [rows, N] = f(x [rows, K] . W + b) on matrix units, W packed by pack_bf16. `bias_kind` is HAS_BIAS of
/// the kernel.
void launch_bf16_product(Launch& launch, const Tensor& x, const Tensor& packed, const Tensor& bias,
                         const Tensor& y, int bias_kind, int activation) {
  const std::int64_t inner = x.channels(), panel = packed.channels(), panels = tiles(y.channels(), panel);
  const std::int64_t block = std::clamp<std::int64_t>((1 << 16) / packed_rows(inner) / 32 * 32, 32, 128);
  const std::size_t blocks = tiles(x.rows(), block);
  const bool few = blocks < 16;
  launch
      .kernel("linear.cl", "linear_forward_bf16",
              {{"INNER", inner},
               {"PANEL", panel},
               {"TILE_VECTORS", panel / 16},
               {"ROWS", block},
               {"HAS_BIAS", bias_kind},
               {"ACTIVATION", activation}})
      .args(x, packed, bias, y, x.rows(), y.channels(), bias ? x.rows() / bias.rows() : 1, launch.count_of(x),
            few ? 1 : panels)
      .run({blocks, few ? static_cast<std::size_t>(panels) : 1, 1}, {1, 1, 1});
}

/// Inputs: x, w (for its shape and its gradient), b or absent, packed weights (what the kernel reads).
struct Linear final : Op {
  Linear(Activation activation, bool transposed, Factors factors = Factors::by_mode)
      : activation(activation), transposed(transposed), factors(factors) {}
  std::string_view name() const override { return transposed ? "linear_data_gradient" : "linear"; }

  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &x = in[0].shape, &w = in[1].shape;
    if (w.rank() != 2) fail("[{}] weight {} is no matrix", name(), w.text());
    const std::int64_t inner = w[transposed ? 1 : 0], columns = w[transposed ? 0 : 1];
    if (x.channels() != inner)
      fail("[{}] weight has {} input channels, x has {}", name(), inner, x.channels());
    if (const Shape& b = in[2].shape; b.rank() > 0 && (b.channels() != columns || x.rows() % b.rows() != 0))
      fail("[{}] bias {} does not fit {} rows of {} output channels", name(), b.text(), x.rows(), columns);
    return {{DType::real, x.with_channels(columns), in[0].count}};
  }
  bool accepts_counts() const override { return true; }

  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &packed = launch.in(3), &y = launch.out();
    const Tensor& bias = launch.in(2);
    const int bias_kind = !bias ? 0 : bias.rows() == 1 ? 1 : 2;
    if (factors == Factors::by_mode && suits_bf16(launch, x.channels()))
      return launch_bf16_product(launch, x, packed, bias, y, bias_kind, static_cast<int>(activation));
    const std::int64_t panel = packed.channels();
    const Tile tile = choose_tile(launch, TiledKernel::linear, panel);
    const std::size_t columns = tiles(y.channels(), tile.vectors * launch.vector_width()),
                      rows = tiles(x.rows(), tile.rows);
    constexpr std::int64_t in_cache = 1 << 16;  // numbers of x: 256 KiB
    const std::int64_t block =
        std::clamp<std::int64_t>(in_cache / x.channels() / tile.rows, 1, static_cast<std::int64_t>(rows));
    Launch::Call call = launch.kernel("linear.cl", "linear_forward",
                                      {{"INNER", x.channels()},
                                       {"PANEL", panel},
                                       {"TILE_ROWS", tile.rows},
                                       {"TILE_VECTORS", tile.vectors},
                                       {"HAS_BIAS", bias_kind},
                                       {"ACTIVATION", static_cast<int>(activation)}});
    call.args(x, packed, bias, y, x.rows(), y.channels(), bias ? x.rows() / bias.rows() : 1,
              launch.count_of(x), block);
    if (launch.gpu())
      call.run({columns, rows, 1}, {4, 16, 1});
    else
      call.run({static_cast<std::size_t>(block), columns, tiles(static_cast<std::int64_t>(rows), block)},
               {1, 1, 1});
  }

  Values gradient(const GradientRequest& request) const override {
    const Value x = request.in[0], w = request.in[1];
    const Value grad = activation_gradient(request.out[0], request.grad(), activation);
    Values grads(4);
    if (request.needed[0])
      grads[0] = request.graph.record_one(Linear(Activation::none, !transposed),
                                          {grad, w, Value{}, pack_weights(w, !transposed)});
    if (request.needed[1]) grads[1] = transposed ? outer_sum(grad, x) : outer_sum(x, grad);
    if (request.needed[2]) {
      const Shape& b = request.in[2].shape();
      grads[2] = b.rank() > 1 && b.rows() == x.shape().rows() ? grad : sum_groups(grad, b.rows());
      grads[2] = request.graph.reshape(grads[2], b);
    }
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes& out) const override {
    return 2.0 * static_cast<double>(out[0].shape.elements()) * static_cast<double>(in[0].shape.channels());
  }
  const Activation activation;
  const bool transposed;
  const Factors factors;
};

/// A^T B. The kernel puts vectors on the columns, so the side whose width suits vectors goes there.
struct OuterSum final : Op {
  std::string_view name() const override { return "outer_sum"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.rows() != in[1].shape.rows())
      fail("[outer_sum] {} and {} have different numbers of rows", in[0].shape.text(), in[1].shape.text());
    return {{DType::real, {in[0].shape.channels(), in[1].shape.channels()}}};
  }
  static std::int64_t chunk_rows(const Shape& a, const Shape& b) {
    const std::int64_t in_cache = (1 << 17) / (a.channels() + b.channels());  // half a MiB of both operands
    return chunk_length(a.rows(), std::max<std::int64_t>(64, in_cache), 128);
  }
  /// Whether partial sums over chunks of rows would weigh as much as the operands: then these are packed and
  /// multiplied in one go.
  static bool packs(const Shape& a, const Shape& b) {
    const std::int64_t m = a.channels(), n = b.channels();
    return m * n >= 1 << 12 && a.rows() * (m + n) <= 2 * m * n;
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    const Shape &a = in[0].shape, &b = in[1].shape;
    if (packs(a, b)) {
      const std::int64_t rows = a.rows(), panel = panel_width(b.channels()), most_tile_rows = 14;
      return {{DType::real, {rows, a.channels() + most_tile_rows}},
              {DType::real, {(b.channels() + panel - 1) / panel, packed_rows(rows), panel}}};
    }
    const std::int64_t chunks = (a.rows() + chunk_rows(a, b) - 1) / chunk_rows(a, b);
    return {{DType::real, {chunks, a.channels(), b.channels()}}};
  }
  bool accepts_counts() const override { return true; }
  void launch_packed(Launch& launch) const {
    const Tensor &x = launch.in(0), &y = launch.in(1), &a = launch.workspace(0), &b = launch.workspace(1);
    const std::int64_t rows = x.rows(), m = x.channels(), n = y.channels(), panel = b.channels();
    const Tile tile = choose_tile(launch, TiledKernel::outer_sum, panel);
    const auto pack = [&](const Tensor& from, const Tensor& to, std::int64_t width) {
      pack_fp32(launch, from, to, false, 1, rows, from.channels(), {width, rows, rows}, launch.count_of(x));
    };
    pack(x, a, tile.rows);
    pack(y, b, panel);
    launch
        .kernel("linear.cl", "weight_gradient",
                {{"TILE_ROWS", tile.rows}, {"TILE_VECTORS", tile.vectors}, {"PANEL", panel}, {"PACKED", 1}})
        .args(a, b, launch.out(), rows, m, n, rows, launch.count_of(x))
        .run({tiles(m, tile.rows), tiles(n, tile.vectors * launch.vector_width()), 1},
             launch.gpu() ? std::array<std::size_t, 3>{8, 8, 1} : std::array<std::size_t, 3>{1, 1, 1});
  }
  static bool on_units(const Launch& launch) {
    return launch.bf16() && std::min(launch.in(0).channels(), launch.in(1).channels()) >= 16;
  }
  /// The transposed x times y, packed like weights.
  void launch_packed_bf16(Launch& launch) const {
    const Tensor &x = launch.in(0), &y = launch.in(1), &packed = launch.workspace(1);
    Tensor transposed = launch.workspace(0);
    transposed.type.shape = {x.channels(), x.rows()};
    launch.kernel("linear.cl", "transpose")
        .args(x, transposed, x.rows(), x.channels(), launch.count_of(x))
        .run({static_cast<std::size_t>(x.rows()), 1, 1}, {16, 1, 1});
    pack_bf16(launch, y, packed, false, 1, x.rows(), y.channels(), launch.count_of(x));
    launch_bf16_product(launch, transposed, packed, {}, launch.out(), 0, 0);
  }
  void launch_chunks_bf16(Launch& launch) const {
    const Tensor &x = launch.in(0), &y = launch.in(1), &partial = launch.workspace();
    const std::int64_t m = x.channels(), n = y.channels(), panel = panel_width(n);
    const std::int64_t rows = std::clamp<std::int64_t>((1 << 16) / (m + n) / 32 * 32, 32, 256);
    launch
        .kernel("linear.cl", "weight_gradient_bf16",
                {{"INNER", m}, {"OUTER", n}, {"PANEL", panel}, {"TILE_VECTORS", panel / 16}, {"ROWS", rows}})
        .args(x, y, partial, x.rows(), chunk_rows(x.shape(), y.shape()), launch.count_of(x))
        .run({static_cast<std::size_t>(partial[0]), 1, 1}, {1, 1, 1});
    sum_weight_partials(launch, partial, launch.out(), partial[0], 1, m, n, false);
  }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &y = launch.in(1);
    const bool packed = packs(x.shape(), y.shape());
    // Packed, the rows are the channels of a product: few of them are packed as for fp32.
    if (on_units(launch) && (!packed || suits_bf16(launch, x.rows())))
      return packed ? launch_packed_bf16(launch) : launch_chunks_bf16(launch);
    if (packed) return launch_packed(launch);
    const bool swap = vectors_suit_first(x.channels(), y.channels());
    const Tensor &a = swap ? y : x, &b = swap ? x : y;
    const std::int64_t m = a.channels(), n = b.channels(), chunk = chunk_rows(x.shape(), y.shape());
    const Tensor& partial = launch.workspace();
    const Tile tile = choose_gradient_tile(launch, TiledKernel::outer_sum, m, n);
    launch.kernel("linear.cl", "weight_gradient", {{"TILE_ROWS", tile.rows}, {"TILE_VECTORS", tile.vectors}})
        .args(a, b, partial, a.rows(), m, n, chunk, launch.count_of(x))
        .run({tiles(m, tile.rows), tiles(n, tile.vectors * launch.vector_width()),
              static_cast<std::size_t>(partial[0])},
             launch.gpu() ? std::array<std::size_t, 3>{8, 8, 1} : std::array<std::size_t, 3>{1, 1, 1});
    sum_weight_partials(launch, partial, launch.out(), partial[0], 1, m, n, swap);
  }
  Values gradient(const GradientRequest& request) const override {
    const Value grad = request.grad();  // [M, N]
    Values grads(2);
    if (request.needed[0])
      grads[0] = request.graph.record_one(Linear(Activation::none, true),
                                          {request.in[1], grad, Value{}, pack_weights(grad, true)});
    if (request.needed[1]) grads[1] = linear(request.in[0], grad);
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes& out) const override {
    return 2.0 * static_cast<double>(in[0].shape.rows()) * static_cast<double>(out[0].shape.elements());
  }
};

const RegisterOp register_linear({
    .name = "linear",
    .summary = "y = f(x . w + b)",
    .inputs = {{"x", "[..., K]"}, {"w", "[K, N]"}, {.name = "b", .shape = "[N] or [G, N]", .optional = true}},
    .outputs = {{"y", "[..., N]"}},
    .attributes = {{"activation", "none", "none, relu, leaky_relu, softplus, sigmoid or truncated_exp"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {linear(in[0], in[1], in[2], activation_from(a.text("activation")))};
    },
});

}  // namespace

void sum_weight_partials(Launch& launch, const Tensor& partial, const Tensor& y, std::int64_t chunks,
                         std::int64_t taps, std::int64_t m, std::int64_t n, bool transposed) {
  if (!transposed) return reduce_partials(launch, partial, y, chunks, taps * m * n);
  launch.kernel("linear.cl", "transpose_weight_partials")
      .args(partial, y, chunks, taps, m, n)
      .run({static_cast<std::size_t>(taps * m * n), 1, 1}, {64, 1, 1});
}

Value linear(Value x, Value w, Value b, Activation activation, Factors factors) {
  return x.graph->record_one(Linear(activation, false, factors),
                             {x, w, b, pack_weights(w, false, 0, factors)});
}

Value outer_sum(Value x, Value y) { return x.graph->record_one(OuterSum(), {x, y}); }

}  // namespace vivant
