#include "vivant/ops/attention.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "vivant/graph/executor.hpp"
#include "vivant/ops/reduction.hpp"

using namespace vivant;

TEST_CASE("attention to equal values has deviation 0 and a gradient that is finite") {
  Device device;
  Graph graph;
  const Value q = graph.input("q", {3, 2}), k = graph.input("k", {5, 2}), v = graph.input("v", {5, 17});
  const AttentionStatistics result = attention(q, k, v);
  const Values grads = differentiate(graph, sum(result.deviation), {q, k, v});
  Executor executor(device, graph, {result.mean, result.deviation, grads[0], grads[1], grads[2]});
  const std::vector<float> queries = {1, 2, -1, 0, 3, 1}, keys = {0, 1, 1, 0, -1, 1, 2, 2, 0, 0};
  executor.write(q, std::span<const float>(queries));
  executor.write(k, std::span<const float>(keys));
  executor.write(v, std::span<const float>(std::vector<float>(5 * 17, 3.5f)));
  executor.run();
  for (const float x : executor.read(result.mean)) CHECK(x == doctest::Approx(3.5));
  for (const float x : executor.read(result.deviation)) CHECK(x == 0.0f);
  for (const Value& grad : grads)
    for (const float x : executor.read(grad)) CHECK(x == 0.0f);
}
