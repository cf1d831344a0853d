#include "vivant/model/occupancy_grid.hpp"

#include <algorithm>

#include "vivant/graph/executor.hpp"

namespace vivant {
namespace {

/// Densities at `nodes` points along each axis, [z, y, x].
std::vector<float> densities(Device& device, const Field& field, const BakedPlanes& planes,
                             std::int64_t nodes) {
  const std::int64_t slice = nodes * nodes;
  Graph graph;
  const Value points = graph.input("points", {slice, 3});
  const Value density = field.density(graph, field.features(graph, planes.value(graph), points));
  Executor executor(device, graph, {density});
  const auto coordinate = [&](std::int64_t node) {
    return static_cast<float>((static_cast<double>(node) + 0.5) / static_cast<double>(nodes) * 2 - 1);
  };
  std::vector<float> all, places(3 * slice);
  all.reserve(nodes * slice);
  for (std::int64_t z = 0; z < nodes; ++z) {
    for (std::int64_t i = 0; i < slice; ++i) {
      places[3 * i] = coordinate(i % nodes);
      places[3 * i + 1] = coordinate(i / nodes);
      places[3 * i + 2] = coordinate(z);
    }
    executor.write(points, std::span<const float>(places));
    executor.run();
    const std::vector<float> some = executor.read(density);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

/// Along one axis, of which neighbours are `stride` apart: the least or largest of the nodes of a cell, whose
/// first one is asked, and of the cells beside it.
template <typename Choose>
std::vector<float> spread(const std::vector<float>& numbers, std::int64_t stride, std::int64_t nodes,
                          Choose choose) {
  std::vector<float> result(numbers.size());
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(numbers.size()); ++i) {
    const std::int64_t node = i / stride % nodes;
    float chosen = numbers[i];
    for (std::int64_t k = std::max<std::int64_t>(node - 2, 0); k <= std::min(node + 3, nodes - 1); ++k)
      chosen = choose(chosen, numbers[i + (k - node) * stride]);
    result[i] = chosen;
  }
  return result;
}

}  // namespace

OccupancyGrid::OccupancyGrid(Device& device, const Field& field, const BakedPlanes& planes)
    : name_("occupancy of " + field.name()), cells_(field.options().plane_size / 2) {
  const std::int64_t nodes = 2 * cells_, cells = cells_;
  std::vector<float> least = densities(device, field, planes, nodes), largest = least;
  for (const std::int64_t stride : {std::int64_t{1}, nodes, nodes * nodes}) {
    least = spread(least, stride, nodes, [](float a, float b) { return std::min(a, b); });
    largest = spread(largest, stride, nodes, [](float a, float b) { return std::max(a, b); });
  }
  std::vector<float> bounds;
  bounds.reserve(2 * cells * cells * cells);
  for (std::int64_t z = 0; z < cells; ++z)
    for (std::int64_t y = 0; y < cells; ++y)
      for (std::int64_t x = 0; x < cells; ++x) {
        const std::int64_t node = (2 * z * nodes + 2 * y) * nodes + 2 * x;
        bounds.push_back(least[node]);
        bounds.push_back(largest[node]);
      }
  bounds_ = std::make_shared<Buffer>(device.allocate(bounds.size() * sizeof(float)));
  device.write(*bounds_, bounds.data(), bounds.size() * sizeof(float));
}

OccupiedSamples OccupancyGrid::occupied_samples(Graph& graph, Value points, Value deltas,
                                                double threshold) const {
  const Value bounds = graph.named(name_, [&] {
    return graph.external(name_, {DType::real, {cells_, cells_, cells_, 2}}, {bounds_, 0});
  });
  return vivant::occupied_samples(bounds, points, deltas, threshold);
}

}  // namespace vivant
