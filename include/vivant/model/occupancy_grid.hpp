#pragma once
#include <memory>

#include "vivant/model/baked_planes.hpp"
#include "vivant/ops/occupied_samples.hpp"

namespace vivant {

/// Bounds of a field's density on a grid over [-1, 1]^3, made once for rendering: samples in empty space and
/// behind surfaces need not be looked at. A cell is two texels of the planes wide; its bounds are the least
/// and the largest density at the texels' centres in it and in the cells around it. Between centres the
/// density may go a little beyond them.
class OccupancyGrid {
 public:
  static constexpr std::int64_t largest_planes = 128;  ///< for larger ones a grid costs more than it saves

  /// `planes`: what Field::planes gives, such as BakedPlanes.
  OccupancyGrid(Device& device, const Field& field, const BakedPlanes& planes);
  /// The samples that may weigh more than `threshold`, see vivant::occupied_samples.
  OccupiedSamples occupied_samples(Graph& graph, Value points, Value deltas, double threshold) const;

 private:
  std::string name_;
  std::int64_t cells_;  // along each axis
  std::shared_ptr<Buffer> bounds_;
};

}  // namespace vivant
