#include "vivant/ops/mlp.hpp"

#include <algorithm>

#include "ops/partials.hpp"
#include "ops/tiles.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// Whole panels.
std::int64_t padded(std::int64_t width) {
  const std::int64_t panel = panel_width(width);
  return (width + panel - 1) / panel * panel;
}

/// The widths of a chain of layers, and how a kernel is told of them.
struct Chain {
  std::vector<std::int64_t> widths;  ///< of x and of every layer's output

  std::int64_t layers() const { return static_cast<std::int64_t>(widths.size()) - 1; }
  std::int64_t widest() const {
    std::int64_t widest = 0;
    for (const std::int64_t width : widths) widest = std::max(widest, padded(width));
    return widest;
  }
  /// LAYER(index, inputs, outputs, panel) of layer l.
  std::string layer(std::int64_t l, bool gradient) const {
    const std::int64_t in = widths[l], out = widths[l + 1];
    return fmt::format("LAYER({},{},{},{})", l, in, out, panel_width(gradient ? in : out));
  }
  Defines defines(std::int64_t rows, bool gradient, bool relu) const {
    std::string forth, back;
    for (std::int64_t l = 0; l < layers(); ++l) {
      forth += layer(l, gradient);
      back += layer(layers() - 1 - l, gradient);
    }
    return {{"LAYERS", forth},
            {"REVERSED", back},
            {"LAST", layers() - 1},
            {"ROWS", rows},
            {"WIDEST", widest()},
            {"FIRST_WIDTH", widths.front()},
            {"LAST_WIDTH", widths.back()},
            {"OUTPUT_RELU", relu ? 1 : 0}};
  }
};

/// Rows that go through the layers together: register tiles divide those of CPUs, those of GPUs fit into
/// local memory. Matrix units take 32 at a time.
std::int64_t block_rows(const Launch& launch, const Chain& chain, std::int64_t on_cpu) {
  if (launch.bf16()) return 96;
  return launch.gpu() ? std::max<std::int64_t>(1, 1024 / chain.widest()) : on_cpu;
}

std::array<std::size_t, 3> group(const Launch& launch) {
  return {launch.gpu() ? std::size_t{64} : std::size_t{1}, 1, 1};
}

/// Inputs: x, y (when it ends in a relu), gradient of y, and for each layer its input (x, or the layer
/// before), w, and w packed and transposed. Outputs: the gradients of x (`of_x`) and of each layer's w and b
/// (`of_layers`).
struct MlpGradient final : Op {
  MlpGradient(bool relu, bool of_x, bool of_layers) : relu(relu), of_x(of_x), of_layers(of_layers) {}
  std::string_view name() const override { return "mlp_gradient"; }
  static constexpr int fixed = 3, per_layer = 3;

  static Chain chain(const TensorTypes& in) {
    Chain chain{{in[0].shape.channels()}};
    for (std::size_t i = fixed; i < in.size(); i += per_layer) chain.widths.push_back(in[i + 1].shape[1]);
    return chain;
  }
  TensorTypes infer(const TensorTypes& in) const override {
    TensorTypes out;
    if (of_x) out.push_back(in[0]);
    if (!of_layers) return out;
    for (std::size_t i = fixed; i < in.size(); i += per_layer) {
      out.push_back({DType::real, in[i + 1].shape});
      out.push_back({DType::real, {in[i + 1].shape[1]}});
    }
    return out;
  }
  bool accepts_counts() const override { return true; }
  /// Rows of one work-item, so that all partial sums fit into 64 MiB.
  static std::int64_t chunk_rows(const Shape& x, const Chain& chain) {
    std::int64_t weights = 0;
    for (std::int64_t l = 0; l < chain.layers(); ++l) weights += chain.widths[l] * chain.widths[l + 1];
    return chunk_length(x.rows(), 192, std::clamp<std::int64_t>((1 << 24) / weights, 2, 64));
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    if (!of_layers) return {};
    const std::int64_t chunk = chunk_rows(in[0].shape, chain(in)),
                       chunks = (in[0].shape.rows() + chunk - 1) / chunk;
    TensorTypes partials;
    for (std::size_t i = fixed; i < in.size(); i += per_layer) {
      const Shape& w = in[i + 1].shape;
      partials.push_back({DType::real, {chunks, w[0], w[1]}});
      partials.push_back({DType::real, {chunks, w[1]}});
    }
    return partials;
  }
  void launch(Launch& launch) const override {
    TensorTypes types;
    for (const Tensor& tensor : launch.inputs) types.push_back(tensor.type);
    const Chain widths = chain(types);
    const Tensor &x = launch.in(0), none;
    const std::int64_t rows = x.rows(), chunk = chunk_rows(x.shape(), widths),
                       chunks = (rows + chunk - 1) / chunk;
    Defines defines = widths.defines(block_rows(launch, widths, 48), true, relu);
    defines.emplace_back("SAMPLE_GRADIENT", of_x ? 1 : 0);
    defines.emplace_back("LAYER_GRADIENT", of_layers ? 1 : 0);
    Launch::Call call = launch.kernel("mlp.cl", "mlp_gradient", defines);
    call.args(launch.in(1), launch.in(2), of_x ? launch.out(0) : none, rows, chunk, launch.count_of(x));
    for (std::int64_t l = 0; l < widths.layers(); ++l) {
      const auto at = static_cast<int>(l);
      call.args(launch.in(fixed + per_layer * at), launch.in(fixed + per_layer * at + 2),
                of_layers ? launch.workspace(2 * at) : none, of_layers ? launch.workspace(2 * at + 1) : none);
    }
    call.run({static_cast<std::size_t>(chunks) * group(launch)[0], 1, 1}, group(launch));
    if (!of_layers) return;
    for (std::size_t i = 0; i < launch.scratch.size(); ++i) {
      const Tensor &partial = launch.scratch[i], &out = launch.out(static_cast<int>(i) + (of_x ? 1 : 0));
      reduce_partials(launch, partial, out, chunks, out.elements());
    }
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    const Chain widths = chain(in);
    double products = 0;
    for (std::int64_t l = 0; l < widths.layers(); ++l)
      products += ((l > 0 || of_x ? 1 : 0) + (of_layers ? 1 : 0)) *
                  static_cast<double>(widths.widths[l] * widths.widths[l + 1]);
    return 2 * static_cast<double>(in[0].shape.rows()) * products;
  }
  const bool relu, of_x, of_layers;
};

/// Inputs: x, and for each layer w, b or absent, and w packed. Outputs: y, and what the layers before the
/// last one give, for the gradient.
struct Mlp final : Op {
  explicit Mlp(bool relu) : relu(relu) {}
  std::string_view name() const override { return "mlp"; }
  static constexpr int per_layer = 3;

  static Chain chain(const TensorTypes& in) {
    Chain chain{{in[0].shape.channels()}};
    for (std::size_t i = 1; i < in.size(); i += per_layer) chain.widths.push_back(in[i].shape[1]);
    return chain;
  }
  TensorTypes infer(const TensorTypes& in) const override {
    std::int64_t width = in[0].shape.channels();
    std::vector<TensorType> between;
    for (std::size_t i = 1; i < in.size(); i += per_layer) {
      const Shape &w = in[i].shape, &b = in[i + 1].shape;
      if (w.rank() != 2 || w[0] != width)
        fail("[mlp] weight {} of layer {} does not fit {} channels before it", w.text(), i / per_layer,
             width);
      if (b.rank() > 0 && b != Shape{w[1]})
        fail("[mlp] bias {} of layer {} does not fit {} output channels", b.text(), i / per_layer, w[1]);
      width = w[1];
      between.push_back({DType::real, in[0].shape.with_channels(width), in[0].count});
    }
    TensorTypes out = {between.back()};
    out.insert(out.end(), between.begin(), between.end() - 1);
    return out;
  }
  bool accepts_counts() const override { return true; }
  bool skips_unread() const override { return true; }
  void launch(Launch& launch) const override {
    TensorTypes types;
    for (const Tensor& tensor : launch.inputs) types.push_back(tensor.type);
    const Chain widths = chain(types);
    const Tensor& x = launch.in(0);
    const std::int64_t block = block_rows(launch, widths, 24);
    Launch::Call call = launch.kernel("mlp.cl", "mlp", widths.defines(block, false, relu));
    call.args(x, x.rows(), launch.count_of(x));
    for (std::int64_t l = 0; l < widths.layers(); ++l) {
      const auto at = static_cast<int>(l);
      call.args(launch.in(per_layer * at + 3), launch.in(per_layer * at + 2),
                launch.out(l + 1 < widths.layers() ? at + 1 : 0));
    }
    call.run({tiles(x.rows(), block) * group(launch)[0], 1, 1}, group(launch));
  }
  Values gradient(const GradientRequest& request) const override {
    const Values& in = request.in;
    const bool of_layers =
        std::any_of(request.needed.begin() + 1, request.needed.end(), [](bool b) { return b; });
    Values inputs = {in[0], relu ? request.out[0] : Value{}, request.grad()};
    for (std::size_t i = 1; i < in.size(); i += per_layer) {
      const std::size_t layer = i / per_layer;
      inputs.insert(inputs.end(),
                    {layer == 0 ? in[0] : request.out[layer], in[i], pack_weights(in[i], true)});
    }
    const Values found =
        request.graph.record(std::make_shared<MlpGradient>(relu, request.needed[0], of_layers), inputs);
    Values grads(in.size());
    std::size_t next = 0;
    if (request.needed[0]) grads[0] = found[next++];
    for (std::size_t i = 1; of_layers && i < in.size(); i += per_layer)
      for (const std::size_t parameter : {i, i + 1}) {
        grads[parameter] = in[parameter] ? found[next] : Value{};
        ++next;
      }
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    double products = 0;
    for (std::size_t i = 1; i < in.size(); i += per_layer)
      products += static_cast<double>(in[i].shape.elements());
    return 2 * static_cast<double>(in[0].shape.rows()) * products;
  }
  const bool relu;
};

const RegisterOp register_mlp({
    .name = "mlp",
    .summary = "fully connected layers with ReLUs between them, in one kernel",
    .inputs = {{"x", "[..., K0]"},
               {"w0", "[K0, K1]"},
               {.name = "b0", .shape = "[K1]", .optional = true},
               {.name = "w1", .shape = "[K1, K2]", .optional = true},
               {.name = "b1", .shape = "[K2]", .optional = true},
               {.name = "w2", .shape = "[K2, K3]", .optional = true},
               {.name = "b2", .shape = "[K3]", .optional = true}},
    .outputs = {{"y", "[..., N]"}},
    .attributes = {{"output", "none", "activation of the last layer: none or relu"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      std::vector<MlpLayer> layers;
      for (std::size_t i = 1; i < in.size() && in[i]; i += 2) layers.push_back({in[i], in[i + 1]});
      for (std::size_t i = 1 + 2 * layers.size(); i < in.size(); ++i)
        if (in[i]) fail("[mlp] an input of layer {} is there, but not all weights up to it", (i - 1) / 2);
      return {mlp(in[0], layers, activation_from(a.text("output")))};
    },
});

}  // namespace

Value mlp(Value x, std::span<const MlpLayer> layers, Activation output) {
  if (output != Activation::none && output != Activation::relu)
    fail("[mlp] the last layer's activation must be none or relu, it is {}", name_of(output));
  if (layers.empty()) fail("[mlp] there is no layer");
  Values inputs = {x};
  for (const MlpLayer& layer : layers)
    inputs.insert(inputs.end(), {layer.w, layer.b, pack_weights(layer.w, false)});
  return x.graph->record(std::make_shared<Mlp>(output == Activation::relu), inputs).front();
}

}  // namespace vivant
