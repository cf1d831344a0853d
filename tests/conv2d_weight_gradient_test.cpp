#include "ops/conv2d_weight_gradient.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "graph_helpers.hpp"
#include "vivant/ops/concat.hpp"

using namespace vivant;

namespace {

std::vector<float> noise(std::int64_t count, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<float> normal;
  std::vector<float> values(count);
  for (float& value : values) value = normal(generator);
  return values;
}

}  // namespace

// 224 x 208 channels are more than a work-item takes at a time by Winograd's algorithm, 112 are not.
TEST_CASE("conv2d_weight_gradient: many input channels have the gradients of their halves") {
  constexpr std::int64_t height = 27, width = 26, half = 112, out = 208;
  Graph graph;
  const Value left = graph.input("left", {height, width, half}),
              right = graph.input("right", {height, width, half}),
              grad = graph.input("grad", {height, width, out});
  const auto of = [&](Value x) { return conv2d_weight_gradient(x, grad, 1, true); };
  const Value whole = of(concat({left, right})), of_left = of(left), of_right = of(right);
  Run run(graph, {whole, of_left, of_right});
  run.write(left, noise(height * width * half, 1));
  run.write(right, noise(height * width * half, 2));
  run.write(grad, noise(height * width * out, 3));
  const std::vector<float> found = run.read(whole), a = run.read(of_left), b = run.read(of_right);
  double difference = 0, size = 0;
  for (std::int64_t tap = 0; tap < 9; ++tap)
    for (std::int64_t i = 0; i < 2 * half * out; ++i) {
      const std::int64_t within = i % (half * out) + tap * half * out;
      const double expected = i < half * out ? a[within] : b[within];
      difference += std::pow(found[tap * 2 * half * out + i] - expected, 2);
      size += expected * expected;
    }
  CHECK(size > 0);
  CHECK(std::sqrt(difference) <= tolerance(2e-6) * std::sqrt(size));
}

// 17 x 17 tiles are more than a chunk, whose partial sums are added.
TEST_CASE("conv2d_weight_gradient: a large picture has the sum over its pixels") {
  constexpr std::int64_t height = 67, width = 66, inner = 16, outer = 32;
  Graph graph;
  const Value x = graph.input("x", {height, width, inner}),
              grad = graph.input("grad", {height, width, outer}),
              y = conv2d_weight_gradient(x, grad, 1, false);
  Run run(graph, {y});
  const std::vector<float> from = noise(height * width * inner, 1), to = noise(height * width * outer, 2);
  run.write(x, from);
  run.write(grad, to);
  const std::vector<float> found = run.read(y);
  double difference = 0, size = 0;
  for (std::int64_t i = 0; i < 9 * inner * outer; ++i) {
    const std::int64_t down = i / (3 * inner * outer) - 1, right = i / (inner * outer) % 3 - 1;
    double sum = 0;
    for (std::int64_t row = std::max<std::int64_t>(0, -down); row < std::min(height, height - down); ++row)
      for (std::int64_t column = std::max<std::int64_t>(0, -right); column < std::min(width, width - right);
           ++column)
        sum +=
            static_cast<double>(from[((row + down) * width + column + right) * inner + i / outer % inner]) *
            to[(row * width + column) * outer + i % outer];
    difference += std::pow(found[i] - sum, 2);
    size += sum * sum;
  }
  CHECK(std::sqrt(difference) <= tolerance(2e-6) * std::sqrt(size));
}
