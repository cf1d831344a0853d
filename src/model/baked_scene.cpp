#include "vivant/model/baked_scene.hpp"

namespace vivant {

BakedScene::BakedScene(Device& device, const SceneModel& scene, double threshold)
    : scene_(scene), threshold_(threshold), planes_(device, scene.field()) {
  const FieldOptions& field = scene.field().options();
  const bool evenly = scene.coarse_samples() == 0;  // the grid finds the occupied ones of many samples
  if (evenly && threshold > 0 && field.encoding != Encoding::mlp &&
      field.plane_size <= OccupancyGrid::largest_planes)
    grid_.emplace(device, scene.field(), planes_);
}

FieldSamples BakedScene::sample(Graph& graph, const Rays& rays, Output output) const {
  const Value planes = planes_.value(graph);
  if (!grid_) return scene_.sample(graph, planes, rays, nullptr, output);
  return scene_.sample_occupied(graph, planes, rays, *grid_, threshold_, output);
}

}  // namespace vivant
