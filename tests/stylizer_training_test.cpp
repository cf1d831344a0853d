#include <doctest/doctest.h>

#include <algorithm>
#include <map>

#include "vivant/graph/executor.hpp"
#include "vivant/model/stylizer.hpp"
#include "vivant/nn/optimizer.hpp"
#include "vivant/ops/loss.hpp"

using namespace vivant;

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
