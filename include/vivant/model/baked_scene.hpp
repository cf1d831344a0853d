#pragma once
#include <optional>

#include "vivant/model/baked_planes.hpp"
#include "vivant/model/occupancy_grid.hpp"
#include "vivant/model/scene_model.hpp"

namespace vivant {

/// A scene as it was when this was made, for rendering: planes and density bounds are computed once.
class BakedScene {
 public:
  /// Samples that weigh less than `threshold` need not be looked at; 0: all are. Scenes with coarse samples,
  /// fields without planes and those with large ones have no bounds: a grid of their densities would cost
  /// more than it saves.
  BakedScene(Device& device, const SceneModel& scene, double threshold);
  /// SceneModel::sample without randomness, as far as samples are looked at.
  FieldSamples sample(Graph& graph, const Rays& rays, Output output) const;

 private:
  const SceneModel& scene_;
  double threshold_;
  BakedPlanes planes_;
  std::optional<OccupancyGrid> grid_;
};

}  // namespace vivant
