// The workloads of single ops.
#include "rays.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/mlp.hpp"
#include "vivant/ops/triplane.hpp"
#include "vivant/ops/volume_render.hpp"
#include "workload.hpp"

namespace vivant::bench {
namespace {

/// 3x3, zero padding; `part`: forward, data gradient or weight gradient.
struct Convolution final : Workload {
  Convolution(Device& device, const Sizes& sizes) : Workload(device) {
    const std::int64_t height = sizes.at("height"), width = sizes.at("width"), in = sizes.at("in"),
                       out = sizes.at("out");
    const std::string part = sizes.at("part");
    const Value x = input("x", {height, width, in}), w = input("w", {3, 3, in, out}),
                g = input("g", {height, width, out});
    const Value y = conv2d(x, w);
    prepare({{"y", part == "forward"
                       ? y
                       : differentiate(graph_, {y}, {g}, {part == "data gradient" ? x : w}).front()}});
  }
};

/// x . w; `part`: forward or backward, both gradients.
struct Product final : Workload {
  Product(Device& device, const Sizes& sizes) : Workload(device) {
    const std::int64_t rows = sizes.at("rows"), in = sizes.at("in"), out = sizes.at("out");
    const Value x = input("x", {rows, in}), w = input("w", {in, out}), g = input("g", {rows, out});
    const Value y = linear(x, w);
    if (sizes.at("part") == "forward") {
      prepare({{"y", y}});
    } else {
      const Values gradients = differentiate(graph_, {y}, {g}, {x, w});
      prepare({{"gradient of x", gradients[0]}, {"gradient of w", gradients[1]}});
    }
  }
};

/// Layers of the given widths, ReLU between; `part`: forward, or forward and backward to everything.
struct Perceptron final : Workload {
  Perceptron(Device& device, const Sizes& sizes) : Workload(device) {
    const std::vector<std::int64_t> widths = sizes.at("widths");
    const std::int64_t rows = sizes.at("rows");
    const Value x = input("x", {rows, widths[0]});
    std::vector<MlpLayer> layers;
    Values wrt = {x};
    std::vector<std::string> names = {"x"};
    for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
      const double bound = std::sqrt(6.0 / static_cast<double>(widths[i]));
      const std::string w_name = fmt::format("w{}", i), b_name = fmt::format("b{}", i);
      const Value w = input(w_name, {widths[i], widths[i + 1]}, Range{-bound, bound}),
                  b = input(b_name, {widths[i + 1]}, Range{-0.1, 0.1});
      layers.push_back({w, b});
      wrt.insert(wrt.end(), {w, b});
      names.insert(names.end(), {w_name, b_name});
    }
    const Value y = mlp(x, layers);
    std::map<std::string, Value> outputs = {{"y", y}};
    if (sizes.at("part") != "forward") {
      const Values gradients = differentiate(graph_, {y}, {input("g", {rows, widths.back()})}, wrt);
      for (std::size_t i = 0; i < wrt.size(); ++i) outputs["gradient of " + names[i]] = gradients[i];
    }
    prepare(outputs);
  }
};

/// The gradient of tri-planes by atomic additions, the common way, for comparison alone: its bits depend on
/// the order in which work-items come. Inputs: planes, points, gradient of the samples.
struct CompareExchangeScatter final : Op {
  std::string_view name() const override { return "triplane_compare_exchange"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  void launch(Launch& launch) const override {
    const Tensor &planes = launch.in(0), &points = launch.in(1);
    const std::int64_t block = launch.gpu() ? 1 : 32, items = (points.rows() + block - 1) / block;
    launch.zero(launch.out());
    launch
        .kernel("triplane_compare_exchange.cl", "triplane_compare_exchange",
                {{"CHANNELS", planes.channels()}})
        .args(planes, points, launch.in(2), launch.out(), points.rows(), planes[1], planes[2], block)
        .run({static_cast<std::size_t>(items), 1, 1}, {launch.gpu() ? std::size_t{64} : 1, 1, 1});
  }
};

/// Points along rays in three planes; `part`: gather, or the planes' gradient alone: scatter, or scatter by
/// compare-exchange.
struct Triplane final : Workload {
  Triplane(Device& device, const Sizes& sizes) : Workload(device) {
    const std::int64_t size = sizes.at("size"), channels = sizes.at("channels"), rays = sizes.at("rays"),
                       samples = sizes.at("samples");
    const Value planes = input("planes", {3, size, size, channels}, {0.5, 1.5}),
                points = given("points", {rays * samples, 3}, ray_points(rays, samples));
    const Value y = triplane_sample(planes, points);
    const Value g = input("g", y.shape());
    prepare({{"y", part(sizes.at("part"), planes, points, y, g)}});
  }
  Value part(const std::string& name, Value planes, Value points, Value y, Value g) {
    if (name == "gather") return y;
    if (name == "scatter") return differentiate(graph_, {y}, {g}, {planes}).front();
    return graph_.record_one(CompareExchangeScatter(), {planes, points, g});
  }
};

/// Weights and rendered features; `part`: forward or backward to densities and features.
struct VolumeRendering final : Workload {
  VolumeRendering(Device& device, const Sizes& sizes) : Workload(device) {
    const std::int64_t rays = sizes.at("rays"), samples = sizes.at("samples"),
                       channels = sizes.at("channels");
    const Value density = input("density", {rays, samples}, {0, 10}),
                feature = input("feature", {rays * samples, channels});
    std::vector<float> steps(rays * samples, 2.0f / static_cast<float>(samples)), depth(rays * samples);
    for (std::int64_t i = 0; i < rays * samples; ++i) depth[i] = static_cast<float>(i % samples) * steps[i];
    const Value delta = given("delta", {rays, samples}, steps),
                depths = given("depths", {rays, samples}, depth);
    const Rendered rendered = volume_render(density, delta, depths, feature);
    if (sizes.at("part") == "forward") {
      prepare({{"feature", rendered.feature}, {"alpha", rendered.alpha}, {"depth", rendered.depth}});
    } else {
      const Value g = input("g", rendered.feature.shape());
      const Values gradients = differentiate(graph_, {rendered.feature}, {g}, {density, feature});
      prepare({{"gradient of density", gradients[0]}, {"gradient of feature", gradients[1]}});
    }
  }
};

/// y = a + b / 2 with plain stores: the measure of ops that only move data.
struct TriadOp final : Op {
  std::string_view name() const override { return "triad"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  void launch(Launch& launch) const override {
    constexpr std::int64_t block = 64;  // vectors of a work-item
    const std::int64_t items = launch.out().elements() / (block * launch.vector_width());
    launch.kernel("limits.cl", "triad", {{"BLOCK", block}})
        .args(launch.in(0), launch.in(1), launch.out(), 0.5)
        .run({static_cast<std::size_t>(items), 1, 1}, {launch.gpu() ? std::size_t{64} : 1, 1, 1});
  }
};

/// `bytes`: read and written together.
struct Triad final : Workload {
  Triad(Device& device, const Sizes& sizes) : Workload(device) {
    const std::int64_t whole = 1 << 16;  // numbers: whole groups of every device
    const std::int64_t numbers = (sizes.at("bytes").get<std::int64_t>() / 12 + whole - 1) / whole * whole;
    prepare({{"y", graph_.record_one(TriadOp(), {input("a", {numbers}), input("b", {numbers})})}});
  }
};

}  // namespace

WorkloadTable op_workloads() {
  return {{"convolution", make<Convolution>},
          {"product", make<Product>},
          {"perceptron", make<Perceptron>},
          {"triplane", make<Triplane>},
          {"volume rendering", make<VolumeRendering>},
          {"triad", make<Triad>}};
}

}  // namespace vivant::bench
