#include <doctest/doctest.h>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "vgg19_helpers.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/ops/attention.hpp"
#include "vivant/ops/concat.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/mean_variance_norm.hpp"

using namespace vivant;

namespace {

/// Every `step`-th pixel of x [H, W, C] in both directions.
Value every(Value x, std::int64_t step) {
  Graph& graph = *x.graph;
  const std::int64_t height = x.shape()[0] / step, width = x.shape()[1] / step, channels = x.shape()[2];
  x = slice(graph.reshape(x, {height, step, x.shape()[1], channels}), 1, 0, 1);
  x = slice(graph.reshape(x, {height * width, step, channels}), 1, 0, 1);
  return graph.reshape(x, {height, width, channels});
}

Value normalised_layers(const std::map<std::string, Value>& features) {
  return concat({mean_variance_norm(every(features.at("relu1_1"), 4)),
                 mean_variance_norm(every(features.at("relu2_1"), 2)),
                 mean_variance_norm(features.at("relu3_1"))});
}

/// [H, W, C] as the rows of a matrix.
Value as_rows(Value x) { return x.graph->reshape(x, {x.shape().rows(), x.shape().channels()}); }

}  // namespace

TEST_CASE("AdaAttN at relu3_1 with published weights agrees with an independent program") {
  const auto oracle_path = shared_data("oracles/adaattn_relu3_1.safetensors"),
             weights_path = shared_data("weights/adaattn_3_fp32.safetensors"),
             encoder_path = shared_data("weights/vgg19_normalised_conv0-conv3_1_fp32.safetensors");
  if (oracle_path.empty() || weights_path.empty() || encoder_path.empty()) return;
  const TensorFile oracle = read_safetensors(oracle_path), weights = read_safetensors(weights_path),
                   encoder = read_safetensors(encoder_path);
  Graph graph;
  const Value content = graph.input("content", {128, 128, 3}), style = graph.input("style", {128, 128, 3});
  const auto of_content = published_encoder(encoder, content), of_style = published_encoder(encoder, style);
  const auto project = [&](const std::string& name, Value x) {
    return as_rows(PublishedConvolution(weights, name).apply(x, Activation::none));
  };
  const auto project_exactly = [&](const std::string& name, Value x) {
    return PublishedConvolution(weights, name).project_exactly(as_rows(x));
  };
  const AttentionStatistics attended =
      attention(project_exactly("f", normalised_layers(of_content)),
                project_exactly("g", normalised_layers(of_style)), project("h", of_style.at("relu3_1")));
  const Value norm = as_rows(mean_variance_norm(of_content.at("relu3_1")));
  const Value stylised = add(multiply(attended.deviation, norm), attended.mean);
  const std::map<std::string, Value> outputs = {{"content_relu3_1", of_content.at("relu3_1")},
                                                {"style_relu3_1", of_style.at("relu3_1")},
                                                {"M", attended.mean},
                                                {"S", attended.deviation},
                                                {"F_cs", stylised}};
  Values wanted;
  for (const auto& [name, value] : outputs) wanted.push_back(value);
  Run run(graph, wanted);
  for (const auto& [name, input] : {std::pair{"content_rgb", content}, std::pair{"style_rgb", style}}) {
    const HostTensor& pixels = oracle.at(name, {128, 128, 3});
    run.write(input,
              to_unit(reinterpret_cast<const std::uint8_t*>(pixels.bytes.data()), pixels.bytes.size()));
  }
  run.executor().run();
  for (const auto& [name, value] : outputs) {
    std::vector<double> got = run.executor().read_doubles(value),
                        want = channels_last(oracle.at(name, {256, 32, 32}));
    // A root: where the variance cancels to rounding errors, the oracle's own S is 3e-4 away from the exact
    // one.
    if (name == "S")
      for (auto* deviations : {&got, &want})
        for (double& x : *deviations) x *= x;
    CAPTURE(name);
    CHECK(relative_error(got, want) < tolerance(1e-4));
  }
}
