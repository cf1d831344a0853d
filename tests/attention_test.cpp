#include "vivant/ops/attention.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "graph_helpers.hpp"
#include "vivant/ops/reduction.hpp"

using namespace vivant;

TEST_CASE("attention to equal values has deviation 0 and a gradient that is finite") {
  Graph graph;
  const Value q = graph.input("q", {3, 2}), k = graph.input("k", {5, 2}), v = graph.input("v", {5, 17});
  const AttentionStatistics result = attention(q, k, v);
  const Values grads = differentiate(graph, sum(result.deviation), {q, k, v});
  Run run(graph, {result.mean, result.deviation, grads[0], grads[1], grads[2]});
  run.write(q, {1, 2, -1, 0, 3, 1});
  run.write(k, {0, 1, 1, 0, -1, 1, 2, 2, 0, 0});
  run.write(v, std::vector<float>(5 * 17, 3.5f));
  for (const float x : run.read(result.mean)) CHECK(x == doctest::Approx(3.5));
  for (const float x : run.read(result.deviation)) CHECK(x == 0.0f);
  for (const Value& grad : grads)
    for (const float x : run.read(grad)) CHECK(x == 0.0f);
}

TEST_CASE("attention to a single key gives its value and deviation 0") {
  constexpr std::int64_t keys = 70, channels = 19;
  Graph graph;
  const Value q = graph.input("q", {2, 1}), k = graph.input("k", {keys, 1}),
              v = graph.input("v", {keys, channels});
  const AttentionStatistics result = attention(q, k, v, {}, {.scale = 1000});
  Run run(graph, {result.mean, result.deviation});
  std::vector<float> key_data(keys), values(keys * channels);
  for (std::size_t i = 0; i < key_data.size(); ++i) key_data[i] = static_cast<float>(i);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = 3 + std::sin(static_cast<float>(i));
  run.write(q, {1, -1});  // the last key, the first key
  run.write(k, key_data);
  run.write(v, values);
  const std::vector<float> mean = run.read(result.mean), deviation = run.read(result.deviation);
  for (std::size_t c = 0; c < channels; ++c) {
    CHECK(mean[c] == doctest::Approx(values[(keys - 1) * channels + c]));
    CHECK(mean[channels + c] == doctest::Approx(values[c]));
  }
  for (const float x : deviation) CHECK(x == 0.0f);
}
