#include "vivant/ops/mean_variance_norm.hpp"

#include <doctest/doctest.h>

#include "vivant/graph/executor.hpp"

using namespace vivant;

TEST_CASE("running statistics move towards those of each batch") {
  Device device;
  Graph graph;
  const ChannelStatistics running{graph.input("mean", {2}), graph.input("deviation", {2})};
  const Value x = graph.input("x", {3, 2});
  const ChannelStatistics batch = channel_statistics(x);
  const Value stop = graph.scalar("stop", DType::i32);
  update_running_statistics(running, batch, 0.25, stop);
  Executor executor(device, graph, {batch.mean, batch.deviation});
  const std::vector<float> data = {1, 10, 2, 30, 3, 50}, zeros = {0, 0}, ones = {1, 1};
  executor.write(x, std::span<const float>(data));
  executor.write(running.mean, std::span<const float>(zeros));
  executor.write(running.deviation, std::span<const float>(ones));
  executor.set(stop, 0);
  executor.run();
  executor.run();
  executor.set(stop, 3);
  executor.run();  // changes nothing
  const double towards = 1 - 0.75 * 0.75;
  CHECK(executor.read(running.mean)[0] == doctest::Approx(2 * towards));
  CHECK(executor.read(running.mean)[1] == doctest::Approx(30 * towards));
  CHECK(executor.read(running.deviation)[0] == doctest::Approx(1));
  CHECK(executor.read(running.deviation)[1] == doctest::Approx(20 * towards + 1 - towards));
}

TEST_CASE("channel statistics of a single row are refused") {
  Graph graph;
  CHECK_THROWS_WITH_AS(channel_statistics(graph.input("x", {1, 4})), doctest::Contains("has no two rows"),
                       Error);
}
