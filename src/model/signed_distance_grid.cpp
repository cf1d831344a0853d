#include "vivant/model/signed_distance_grid.hpp"

#include <cmath>

#include "vivant/graph/executor.hpp"
#include "vivant/ops/sample_grid.hpp"

namespace vivant {

SignedDistanceGrid::SignedDistanceGrid(Device& device, const BodyModel& body, double spacing)
    : box_(body.canonical_box()) {
  if (!(spacing > 0)) fail("[signed_distance_grid] the spacing {} is not positive", spacing);
  const auto nodes = [&](int axis) {
    return static_cast<std::int64_t>(std::ceil(box_.size()[axis] / spacing)) + 1;
  };
  shape_ = {nodes(2), nodes(1), nodes(0)};
  std::vector<float> points;
  for (std::int64_t z = 0; z < shape_[0]; ++z)
    for (std::int64_t y = 0; y < shape_[1]; ++y)
      for (std::int64_t x = 0; x < shape_[2]; ++x) {
        const Eigen::Vector3d fraction(static_cast<double>(x) / (shape_[2] - 1),
                                       static_cast<double>(y) / (shape_[1] - 1),
                                       static_cast<double>(z) / (shape_[0] - 1));
        const Eigen::Vector3d point = box_.min + fraction.cwiseProduct(box_.size());
        for (int axis = 0; axis < 3; ++axis) points.push_back(static_cast<float>(point[axis]));
      }
  distances_ = std::make_shared<Buffer>(device.allocate(shape_.elements() * sizeof(float)));
  Graph graph;
  const Value queries = graph.input("points", {shape_.elements(), 3});
  const double everywhere = box_.size().norm();
  const Value distance = closest_point(queries, body.canonical_mesh(graph), everywhere).signed_distance;
  graph.place(distance, {distances_, 0});
  Executor executor(device, graph, {distance});
  executor.write(queries, std::span<const float>(points));
  executor.run();
  device.finish();
}

Value SignedDistanceGrid::sample(Graph& graph, Value points) const {
  const Value grid = graph.external("signed_distances", {DType::real, shape_}, {distances_, 0});
  return sample_grid(grid, points, box_.min, box_.max);
}

}  // namespace vivant
