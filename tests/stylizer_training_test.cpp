#include <doctest/doctest.h>

#include <algorithm>
#include <map>

#include "jobs/stylizer_training.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/model/stylizer.hpp"
#include "vivant/nn/optimizer.hpp"
#include "vivant/ops/loss.hpp"

using namespace vivant;

namespace {

/// Five steps of a training whose loss is that of stylised random features against grey; the losses.
std::vector<double> train_mirrored(Device& device, ParameterStore& store, const Stylizer& stylizer) {
  Graph graph;
  const Value content = graph.input("content", {5, 6, 256}), style = graph.input("style", {7, 4, 256}),
              luma = graph.input("luma", {5, 6, 1});
  const Value stylised = stylizer.attend(graph, content, luma, stylizer.style_tokens(graph, style, {}),
                                         stylizer.statistics(content, luma));
  const Value image = stylizer.decode_image(graph, stylised, {});
  const Value loss = l2_loss(image, graph.constant(image.shape(), std::vector<double>(20 * 24 * 3, 0.5)));
  const auto optimizer = optimise(device, graph, store, loss, stylising_parts(stylizer));
  Executor executor(device, graph, {loss});
  const Initializer random(3);
  executor.write(content, random.normal("content", content.elements(), 1));
  executor.write(style, random.normal("style", style.elements(), 1));
  executor.write(luma, random.normal("luma", luma.elements(), 1));
  std::vector<double> losses;
  for (std::int64_t step = 1; step <= 5; ++step) {
    optimizer->set_step(executor, step, {1e-3});
    executor.run();
    losses.push_back(executor.read(loss)[0]);
  }
  return losses;
}

}  // namespace

TEST_CASE("stylizer: AdaAttN's own forms train f, g, h and the decoder") {
  Device device;
  for (const char* form : {"plain", "cosine"}) {
    CAPTURE(form);
    const Initializer initializer(7);
    ParameterStore store;
    const Stylizer stylizer(store, initializer, StylizerOptions::of_form(form));
    store.allocate(device);
    std::map<std::string, std::vector<float>> before;
    for (const auto& parameter : store.parameters()) before[parameter.name] = store.read(parameter.name);
    const std::vector<double> losses = train_mirrored(device, store, stylizer);
    CHECK(losses.back() < 0.9 * losses.front());
    for (const auto& [name, values] : before) {
      CAPTURE(name);
      // With softmax a bias of the keys adds the same to all scores of a query.
      if (name != "stylizer.key.bias") CHECK(store.read(name) != values);
    }
  }
}

TEST_CASE("stylizer: the weight of the global style loss reaches the training") {
  Device device;
  std::vector<std::vector<float>> trained;
  for (const double weight : {100.0, 100.0, 30.0}) {
    PretrainStylizerOptions options;
    options.photographs = options.paintings = {asset_path("styles")};
    options.global_weight = weight;
    StylizerTraining training(device, options);
    measure_pictures(training, true);
    StyleStep step(training);
    step.run(0, 1, 1e-3);
    trained.push_back(training.store.read("stylizer.psi0.weight"));
  }
  CHECK(trained[0] == trained[1]);
  CHECK(trained[0] != trained[2]);
}

TEST_CASE("stylizer: training psi and the decoder leaves the attention as it is") {
  Device device;
  const Initializer initializer(7);
  ParameterStore store;
  const Stylizer stylizer(store, initializer);
  store.allocate(device);
  Graph graph;
  const Value seen = graph.input("features", {5, 6, 256}), rgb = graph.input("rgb", {20, 24, 3});
  const Value loss = l2_loss(stylizer.reconstruct(graph, seen, rgb), graph.zeros({DType::real, {20, 24, 3}}));
  std::vector<std::string> names;
  Values parameters;
  for (const auto& parameter : store.parameters())
    if (parameter.name.starts_with("stylizer.psi") || parameter.name.starts_with("stylizer.decoder")) {
      names.push_back(parameter.name);
      parameters.push_back(store.value(graph, parameter.name));
    }
  Optimizer optimizer(device, graph, store, names, differentiate(graph, loss, parameters), loss,
                      {.trained = {"stylizer.psi", "stylizer.decoder"}});
  Executor executor(device, graph, {loss});
  executor.write(seen, initializer.normal("features", 5 * 6 * 256, 1));
  executor.write(rgb, std::vector<float>(20 * 24 * 3, 0.5f));
  std::map<std::string, std::vector<float>> before;
  for (const auto& parameter : store.parameters()) before[parameter.name] = store.read(parameter.name);
  optimizer.set_step(executor, 1, {1e-3});
  executor.run();
  CHECK(executor.read(loss)[0] > 0);
  for (const auto& [name, values] : before) {
    const bool trained = std::find(names.begin(), names.end(), name) != names.end();
    CAPTURE(name);
    CHECK((store.read(name) != values) == trained);
  }
}
