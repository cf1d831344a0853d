#include "vivant/ops/loss.hpp"

#include <doctest/doctest.h>

#include "vivant/graph/executor.hpp"

using namespace vivant;

TEST_CASE("losses are 0 with a gradient of 0 at their minima") {
  Device device;
  Graph graph;
  const Value x = graph.input("x", {2, 17});
  const Value hard = hard_loss(x), l1 = l1_loss(x, x);
  const Value hard_slope = differentiate(graph, hard, {x}).front();
  const Value l1_slope = differentiate(graph, l1, {x}).front();
  Executor executor(device, graph, {hard, l1, hard_slope, l1_slope});
  std::vector<float> zeros_and_ones(34);
  for (std::size_t i = 0; i < zeros_and_ones.size(); ++i) zeros_and_ones[i] = static_cast<float>(i % 2);
  executor.write(x, std::span<const float>(zeros_and_ones));
  executor.run();
  CHECK(executor.read(hard)[0] == doctest::Approx(0).scale(1));
  CHECK(executor.read(l1)[0] == 0.0f);
  for (const float slope : executor.read(hard_slope)) CHECK(slope == 0.0f);
  for (const float slope : executor.read(l1_slope)) CHECK(slope == 0.0f);
}
