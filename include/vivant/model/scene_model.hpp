#pragma once
#include "vivant/model/occupancy_grid.hpp"
#include "vivant/model/scene_space.hpp"
#include "vivant/ops/rays.hpp"

namespace vivant {

/// The samples of a batch of rays in one field, before rendering.
struct FieldSamples {
  Value depths, deltas;  ///< [R, S] along the unit directions, in the capture's unit
  Interval range;        ///< where they were drawn
  Value density;         ///< [R, S]
  UnitInputs units;      ///< of the output that was asked for; its rows: see occupied_samples
};

/// What rays see: hidden units and alpha give colours and features by Field::colour and Field::feature.
struct RenderedRays {
  Value hidden;  ///< [R, 128]
  Value alpha;   ///< [R, 1]
  Value depth;   ///< [R, 1], of the surface, see peak_depth
  Value weight;  ///< [R, S]
};

/// The background: a radiance field in the space of a capture.
class SceneModel {
 public:
  /// `coarse_samples`: how many find where a ray's weight is, before the others are drawn there; 0: `samples`
  /// are spread evenly.
  SceneModel(Device& device, ParameterStore& store, const Initializer& initializer,
             const FieldOptions& options, const SceneSpace& space, int samples,
             std::vector<float> occupied_points = {}, int coarse_samples = 0);

  const Field& field() const { return field_; }
  const SceneSpace& space() const { return space_; }
  int coarse_samples() const { return coarse_samples_; }
  /// How samples are spread along a ray.
  Spacing spacing() const { return space_.inverse_depth ? Spacing::disparity : Spacing::linear; }

  /// Stratified samples on rays, or samples where the weight of coarse ones is, jittered with `random` (and
  /// with the stream after its own; absent: at the middles of their strata), and what the field says of them.
  FieldSamples sample(Graph& graph, Value planes, const Rays& rays, const RandomKey* random,
                      Output output = Output::colour) const;
  /// For rendering: samples at the midpoints, those alone that may weigh more than `threshold`.
  FieldSamples sample_occupied(Graph& graph, Value planes, const Rays& rays, const OccupancyGrid& grid,
                               double threshold, Output output) const;
  /// Samples rendered on their own. The alpha is the sum of the weights; `threshold`: see rendered_units.
  RenderedRays render(Graph& graph, const FieldSamples& samples, double threshold = 0) const;

 private:
  struct Placed {
    Samples samples;
    Interval range;
    Value points;  // [R S, 3] in the field's coordinates
  };
  Placed place(Graph& graph, const Rays& rays, int samples, const RandomKey* random) const;
  /// Where the weight of coarse samples is. No gradient comes back this way.
  Placed place_by_weight(Graph& graph, Value planes, const Rays& rays, const RandomKey* random) const;
  UnitInputs units(Graph& graph, Value features, const Rays& rays, Output output) const;
  void finish(Graph& graph, const Rays& rays, Placed& placed) const;

  Field field_;
  SceneSpace space_;
  int samples_, coarse_samples_;
};

/// Points of a capture in the coordinates of its space, [P, 3], for Encoding::occupied.
std::vector<float> occupied_points(const SceneSpace& space, const PointCloud& points);

}  // namespace vivant
