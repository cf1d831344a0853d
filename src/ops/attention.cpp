#include "vivant/ops/attention.hpp"

#include "ops/tiles.hpp"
#include "vivant/ops/concat.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/reduction.hpp"

namespace vivant {
namespace {

constexpr std::int64_t panel = 64;

/// A register tile and how many of them one work-item owns, one below the other.
struct RowTiles {
  RowTiles(const Launch& launch, const Shape& k, const Shape& values) : group(launch.gpu() ? 64 : 1) {
    // Matrix units take 32 rows at a time.
    const Tile tile =
        launch.matrix_tiles() ? Tile{4, 4, 16} : choose_tile(launch, TiledKernel::attention, panel);
    defines = {{"INNER_CHANNELS", k.channels()},
               {"OUTER_CHANNELS", values.channels()},
               {"TILE_ROWS", tile.rows},
               {"TILE_VECTORS", tile.vectors},
               {"TILE_GROUPS", tile.groups}};
    rows = tile.rows * tile.groups;
  }
  Launch::Call kernel(Launch& launch, const char* function) const {
    return launch.kernel("attention.cl", function, defines);
  }
  void run(Launch::Call& call, std::int64_t extent) const {
    call.run({tiles(extent, rows), 1, 1}, {group, 1, 1});
  }
  Defines defines;
  std::int64_t rows;
  std::size_t group;
};

Value packed(Value x, bool transposed) { return pack_weights(x, transposed, panel); }

double product_flops(const Shape& q, const Shape& k, std::int64_t channels) {
  return 2.0 * static_cast<double>(q.rows()) * static_cast<double>(k.rows()) * static_cast<double>(channels);
}

/// What both gradients start from: q, k, values, bias, normaliser, delta, gradient of the output; then packed
/// operands.
enum Input { q, k, values, bias, normaliser, delta, grad, operands };

struct QueryGradient final : Op {
  explicit QueryGradient(const AttentionOptions& options) : options(options) {}
  std::string_view name() const override { return "attend_query_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[q]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const RowTiles tiles(launch, launch.in(k).shape(), launch.in(values).shape());
    auto call = tiles.kernel(launch, "attend_query_gradient");
    call.args(launch.in(q), launch.in(grad), launch.in(operands), launch.in(operands + 1),
              launch.in(operands + 2), launch.in(bias), launch.in(normaliser), launch.in(delta), launch.out(),
              launch.in(q).rows(), launch.in(k).rows(), options.scale, options.cosine ? 1 : 0,
              launch.count_of(launch.in(k)));
    tiles.run(call, launch.in(q).rows());
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return product_flops(in[q].shape, in[k].shape, 2 * in[k].shape.channels() + in[values].shape.channels());
  }
  const AttentionOptions options;
};

struct KeyGradient final : Op {
  explicit KeyGradient(const AttentionOptions& options) : options(options) {}
  std::string_view name() const override { return "attend_key_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override {
    return {in[k], in[values], {DType::real, {in[k].shape.rows()}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const RowTiles tiles(launch, launch.in(k).shape(), launch.in(values).shape());
    if (launch.count_of(launch.in(k)))  // for keys that are not live
      for (int i : {1, 2}) launch.zero(launch.out(i));
    auto call = tiles.kernel(launch, "attend_key_gradient");
    call.args(launch.in(k), launch.in(values), launch.in(operands), launch.in(operands + 1),
              launch.in(operands + 2), launch.in(operands + 3), launch.in(bias), launch.in(normaliser),
              launch.in(delta), launch.out(0), launch.out(1), launch.out(2), launch.in(q).rows(),
              launch.in(k).rows(), options.scale, options.cosine ? 1 : 0, launch.count_of(launch.in(k)));
    tiles.run(call, launch.in(k).rows());
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return product_flops(in[q].shape, in[k].shape,
                         2 * in[k].shape.channels() + 2 * in[values].shape.channels());
  }
  const AttentionOptions options;
};

/// Inputs: q, k, values, bias, packed k^T, packed values. Outputs: o, and the normaliser of each query.
struct Attend final : Op {
  explicit Attend(const AttentionOptions& options) : options(options) {}
  std::string_view name() const override { return "attend"; }
  TensorTypes infer(const TensorTypes& in) const override {
    for (int i : {q, k, values})
      if (in[i].shape.rank() != 2) fail("[attend] {} is no matrix", in[i].shape.text());
    if (in[q].count >= 0) fail("[attend] queries cannot have a device-side count of rows");
    if (in[q].shape[1] != in[k].shape[1])
      fail("[attend] queries have {} channels, keys {}", in[q].shape[1], in[k].shape[1]);
    if (in[k].shape[0] != in[values].shape[0] || (in[values].count >= 0 && in[values].count != in[k].count))
      fail("[attend] {} keys do not go with {} values, or their counts differ", in[k].shape[0],
           in[values].shape[0]);
    if (in[bias].shape.rank() > 0 && in[bias].shape != Shape{in[k].shape[0]})
      fail("[attend] the bias {} is not one number for each of {} keys", in[bias].shape.text(),
           in[k].shape[0]);
    return {{DType::real, {in[q].shape[0], in[values].shape[1]}}, {DType::real, {in[q].shape[0]}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const RowTiles tiles(launch, launch.in(k).shape(), launch.in(values).shape());
    auto call = tiles.kernel(launch, "attend");
    call.args(launch.in(q), launch.in(4), launch.in(5), launch.in(bias), launch.out(0), launch.out(1),
              launch.in(q).rows(), launch.in(k).rows(), options.scale, options.cosine ? 1 : 0,
              launch.count_of(launch.in(k)));
    tiles.run(call, launch.in(q).rows());
  }
  Values gradient(const GradientRequest& request) const override {
    Graph& graph = request.graph;
    const Values& in = request.in;
    const Value grad = request.grad();
    const Value delta = sum_channels(multiply(grad, request.out[0]));
    const Values common = {in[q], in[k], in[values], in[bias], request.out[1], delta, grad};
    Values grads(6);
    if (request.needed[q]) {
      Values inputs = common;
      for (Value operand : {in[4], packed(in[values], true), packed(in[k], false)}) inputs.push_back(operand);
      grads[q] = graph.record(std::make_shared<QueryGradient>(options), inputs).front();
    }
    if (request.needed[k] || request.needed[values] || request.needed[bias]) {
      Values inputs = common;
      for (Value operand :
           {packed(in[q], true), packed(grad, true), packed(in[q], false), packed(grad, false)})
        inputs.push_back(operand);
      const Values out = graph.record(std::make_shared<KeyGradient>(options), inputs);
      grads[k] = out[0];
      grads[values] = out[1];
      if (in[bias]) grads[bias] = out[2];
    }
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return product_flops(in[q].shape, in[k].shape, in[k].shape.channels() + in[values].shape.channels());
  }
  const AttentionOptions options;
};

}  // namespace

Value attend(Value q, Value k, Value values, Value bias, const AttentionOptions& options) {
  if (options.cosine) {
    q = normalise_rows(q);
    k = normalise_rows(k);
  }
  return q.graph
      ->record(std::make_shared<Attend>(options),
               {q, k, values, bias, packed(k, true), packed(values, false)})
      .front();
}

}  // namespace vivant
