// Fields: what their planes are made of.
#include "vivant/model/field.hpp"

#include <doctest/doctest.h>

#include "graph_helpers.hpp"

using namespace vivant;

TEST_CASE("field: vanilla planes are the sum of their scales, the coarse ones enlarged") {
  constexpr std::int64_t size = 32, channels = 16, elements = 3 * size * size * channels;
  Device& device = test_device();
  ParameterStore store;
  const Field field(device, store, Initializer(3), "scene",
                    {.encoding = Encoding::vanilla, .plane_size = size, .channels = channels, .scales = 3});
  store.allocate(device);
  Graph graph;
  const Value planes = field.planes(graph);
  CHECK(planes.shape() == Shape{3, size, size, channels});
  Run run(graph, {planes});
  const std::vector<float> finest = store.read("scene.planes");
  CHECK(run.read(planes) == finest);  // coarse scales start at 0

  std::vector<float> half = store.read("scene.planes2"), quarter = store.read("scene.planes4");
  CHECK(half.size() == elements / 4);
  CHECK(quarter.size() == elements / 16);
  std::fill(half.begin(), half.end(), 0.25f);
  // One cell inside the second plane: row 12 of 3 x 8, column 3, channel 5.
  quarter[(12 * size / 4 + 3) * channels + 5] = 1;
  store.write("scene.planes2", half);
  store.write("scene.planes4", quarter);
  const std::vector<float> sum = run.read(planes);
  double of_quarter = 0;
  for (std::int64_t i = 0; i < elements; ++i) {
    const double added = static_cast<double>(sum[i]) - finest[i] - 0.25;
    of_quarter += added;
    const std::int64_t plane = i / (size * size * channels), row = i / (size * channels) % size,
                       column = i / channels % size, channel = i % channels;
    const bool near = plane == 1 && std::abs(row - 17.5) < 7 && std::abs(column - 13.5) < 7 && channel == 5;
    if (!near) CHECK(std::abs(added) < 1e-6);
  }
  CHECK(of_quarter == doctest::Approx(16).epsilon(1e-4));  // 4 x 4 cells' worth
}
