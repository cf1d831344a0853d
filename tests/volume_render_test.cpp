#include "vivant/ops/volume_render.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>

#include "graph_helpers.hpp"
#include "vivant/io/safetensors.hpp"

using namespace vivant;
namespace fs = std::filesystem;

TEST_CASE("volume_render agrees with an independent renderer") {
  const fs::path path = fs::path(VIVANT_SHARED_DATA) / "oracles/volume_rendering_nerfacc.safetensors";
  if (!fs::exists(path)) {
    MESSAGE("skipped: no " << path);
    return;
  }
  const TensorFile oracle = read_safetensors(path);
  const auto floats = [&](const std::string& name) { return oracle.tensors.at(name).as_doubles(); };
  const std::vector<double> starts = floats("t_starts"), ends = floats("t_ends");
  std::vector<double> delta(starts.size()), depths(starts.size());
  for (std::size_t i = 0; i < starts.size(); ++i) {
    delta[i] = ends[i] - starts[i];
    depths[i] = (starts[i] + ends[i]) / 2;
  }
  Device device;
  for (const Precision precision : {Precision::single, Precision::double_}) {
    Graph graph;
    const Value density = graph.input("density", {5, 64}), interval = graph.input("delta", {5, 64}),
                depth = graph.input("depths", {5, 64}), colour = graph.input("colour", {5, 64, 3});
    const Rendered rendered = volume_render(density, interval, depth, colour);
    Executor executor(device, graph, {rendered.feature, rendered.alpha, rendered.weight},
                      {.precision = precision});
    executor.write(density, std::span<const double>(floats("sigma")));
    executor.write(interval, std::span<const double>(delta));
    executor.write(depth, std::span<const double>(depths));
    executor.write(colour, std::span<const double>(floats("rgb")));
    executor.run();
    const auto relative_error = [&](Value value, const std::string& name) {
      const std::vector<double> got = executor.read_doubles(value), want = floats(name);
      REQUIRE(got.size() == want.size());
      double error = 0, size = 0;
      for (std::size_t i = 0; i < got.size(); ++i) {
        error += (got[i] - want[i]) * (got[i] - want[i]);
        size += want[i] * want[i];
      }
      return std::sqrt(error / size);
    };
    CHECK(relative_error(rendered.feature, "color") < 1e-6);
    CHECK(relative_error(rendered.alpha, "opacity") < 1e-6);
    CHECK(relative_error(rendered.weight, "weights") < 1e-6);
  }
}

TEST_CASE("weighted_sum: a gradient of features that is larger than the caches is weight times gradient") {
  constexpr std::int64_t rays = 1025, samples = 512, channels = 32;  // 67 MB
  static_assert(rays * samples * channels > 1 << 24);
  Graph graph;
  const Value weight = graph.input("weight", {rays, samples}),
              feature = graph.input("feature", {rays * samples, channels}),
              grad = graph.input("gradient", {rays, channels});
  const Value of_feature = differentiate(graph, {weighted_sum(weight, feature)}, {grad}, {feature})[0];
  std::vector<float> weights(rays * samples), grads(rays * channels);
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<float>(i % 1013) / 1013;
  for (std::size_t i = 0; i < grads.size(); ++i) grads[i] = static_cast<float>(i % 997) / 997 - 0.5f;
  Run run(graph, {of_feature});
  run.write(weight, weights);
  run.write(grad, grads);
  const std::vector<float> found = run.read(of_feature);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::size_t sample = i / channels;
    wrong += found[i] != weights[sample] * grads[sample / samples * channels + i % channels];
  }
  CHECK(wrong == 0);
}
