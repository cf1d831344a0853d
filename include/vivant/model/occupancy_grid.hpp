#pragma once
#include <memory>

#include "vivant/model/baked_planes.hpp"
#include "vivant/ops/occupied_samples.hpp"

namespace vivant {

/// Bounds of a field's density on a grid over [-1, 1]^3, made once for rendering: samples in empty space and
/// behind surfaces need not be looked at. A cell's bounds are the least and the largest density at two points
/// per axis in it and in the cells around it: sure where the density changes little within half a cell.
class OccupancyGrid {
 public:
  static constexpr std::int64_t cells = 64;  ///< along each axis

  /// `planes`: what Field::planes gives, such as BakedPlanes.
  OccupancyGrid(Device& device, const Field& field, const BakedPlanes& planes);
  /// The samples that may weigh more than `threshold`, see vivant::occupied_samples.
  OccupiedSamples occupied_samples(Graph& graph, Value points, Value deltas, double threshold) const;

 private:
  std::string name_;
  std::shared_ptr<Buffer> bounds_;
};

}  // namespace vivant
