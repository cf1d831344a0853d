// Fields: what their planes are made of.
#include "vivant/model/field.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

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

TEST_CASE("field: the term of the directions is the bias, and what views that are kept and normals add") {
  constexpr std::int64_t rows = 3, width = Field::hidden_width, octaves = 2, encoded = 3 * (1 + 2 * octaves);
  ParameterStore store;
  FieldOptions options{.encoding = Encoding::vanilla, .plane_size = 16, .channels = 16};
  options.direction_frequencies = octaves;
  options.shading = true;
  const Field field(test_device(), store, Initializer(4), "human", options);
  store.allocate(test_device());
  std::vector<float> bias(width);
  for (std::int64_t i = 0; i < width; ++i) bias[i] = 0.01f * static_cast<float>(i);
  store.write("human.hidden.bias", bias);
  const std::vector<float> weight = store.read("human.direction.weight");
  REQUIRE(weight.size() == (encoded + 3) * width);
  const std::vector<float> views = {0.6f, 0, 0.8f, 0, -1, 0, 0.36f, 0.48f, -0.8f}, kept = {1, 0, 1},
                           facing = {0, 1, 0, 0.8f, 0, -0.6f, 0, 0, 1};

  const auto expected = [&](std::int64_t row, std::int64_t unit, bool with_views, bool with_normals) {
    double sum = bias[unit];
    const auto add = [&](std::int64_t input, double value) { sum += value * weight[input * width + unit]; };
    for (std::int64_t axis = 0; axis < 3; ++axis) {
      const double x = views[3 * row + axis];
      if (with_views && kept[row] != 0) {
        add(axis, x);
        for (std::int64_t octave = 0; octave < octaves; ++octave) {
          const double angle = std::ldexp(std::numbers::pi * x, static_cast<int>(octave));
          add(3 + 6 * octave + axis, std::sin(angle));
          add(6 + 6 * octave + axis, std::cos(angle));
        }
      }
      if (with_normals) add(encoded + axis, facing[3 * row + axis]);
    }
    return sum;
  };
  for (const bool with_views : {false, true})
    for (const bool with_normals : {false, true}) {
      CAPTURE(with_views);
      CAPTURE(with_normals);
      Graph graph;
      const Value directions = graph.input("directions", {rows, 3}), keep = graph.input("keep", {rows, 1}),
                  normals = graph.input("normals", {rows, 3});
      const Facing seen{.directions = with_views ? directions : Value{},
                        .keep = with_views ? keep : Value{},
                        .normals = with_normals ? normals : Value{}};
      const Value term = field.units_of_rays(graph, graph.input("features", {rows, 8}), seen).term;
      Run run(graph, {term});
      if (with_views) run.write(directions, views);
      if (with_views) run.write(keep, kept);
      if (with_normals) run.write(normals, facing);
      const std::vector<float> found = run.read(term);
      REQUIRE(found.size() == (with_views || with_normals ? rows : 1) * width);
      double error = 0;
      for (std::size_t i = 0; i < found.size(); ++i)
        error = std::max(error, std::abs(found[i] - expected(static_cast<std::int64_t>(i) / width,
                                                             static_cast<std::int64_t>(i) % width, with_views,
                                                             with_normals)));
      CHECK(error < tolerance(1e-5, 3e-2));
    }
}
