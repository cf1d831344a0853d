#include "vivant/model/baked_planes.hpp"

#include "vivant/graph/executor.hpp"

namespace vivant {

BakedPlanes::BakedPlanes(Device& device, const Field& field) : name_("baked planes of " + field.name()) {
  Graph graph;
  const Value planes = field.planes(graph);
  if (!planes) return;
  shape_ = planes.shape();
  buffer_ = std::make_shared<Buffer>(device.allocate(planes.elements() * sizeof(float)));
  graph.assign(value(graph), planes);
  Executor(device, graph, {}).run();
}

Value BakedPlanes::value(Graph& graph) const {
  if (!buffer_) return {};
  return graph.named(name_, [&] { return graph.external(name_, {DType::real, shape_}, {buffer_, 0}); });
}

}  // namespace vivant
