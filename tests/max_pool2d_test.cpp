#include "vivant/ops/max_pool2d.hpp"

#include <doctest/doctest.h>

#include "graph_helpers.hpp"

using namespace vivant;

TEST_CASE("max_pool2d: of equal values the first takes the whole gradient") {
  Graph graph;
  const Value x = graph.input("x", {2, 4, 1});
  const Value y = max_pool2d(x), seed = graph.input("seed", {1, 2, 1});
  const Value grad = differentiate(graph, {y}, {seed}, {x}).front();
  Run run(graph, {y, grad});
  run.write(x, {1, 3, 0, 0, 3, 3, 0, 0});
  run.write(seed, {5, 7});
  CHECK(run.read(grad) == std::vector<float>{0, 5, 7, 0, 0, 0, 0, 0});
  CHECK(run.read(y) == std::vector<float>{3, 0});
}
