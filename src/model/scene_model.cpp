#include "vivant/model/scene_model.hpp"

#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/peak_depth.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/volume_render.hpp"

namespace vivant {

namespace {

/// A key for samples at the middle of their strata, which look at no random number.
RandomKey no_randomness(Graph& graph) {
  const std::vector<std::int32_t> zero(1, 0);
  const Value constant = graph.constant({1}, std::span<const std::int32_t>(zero));
  return {constant, constant, 0};
}

/// Makes the last sample hide all behind it: its interval becomes very long.
constexpr double endless = 1e10;

/// Where rays are sampled: in a shell; else between the space's near and far and, in a bounded space, inside
/// of its box, of which the walls themselves may be what there is to see. Rays that miss the box keep near
/// and far.
Interval depth_range(Graph& graph, const SceneSpace& space, const Rays& rays) {
  const std::int64_t count = rays.origins.shape()[0];
  // Where rays are sampled has no gradient.
  const Value origins = graph.detach(rays.origins), directions = graph.detach(rays.directions);
  if (space.shell) return ray_shell(origins, directions, *space.shell);
  const auto limit = [&](double depth) {
    return graph.constant({count, 1}, std::span<const double>(std::vector<double>(count, depth)));
  };
  if (!space.bounded) return {limit(space.near), limit(space.far)};
  constexpr double behind_walls = 1.01;
  std::vector<double> box;
  for (const double side : {-1, 1})
    for (int axis = 0; axis < 3; ++axis) box.push_back(space.centre[axis] + side * space.radius[axis]);
  const Interval inside = ray_box(origins, directions, graph.constant({2, 3}, box), space.near);
  const Value misses = affine(clamp(affine(inside.far, 1e6, 0), 0, 1), -1, 1);
  return {add(clamp(inside.near, 0, 0.99 * space.far), affine(misses, space.near, 0)),
          add(clamp(affine(inside.far, behind_walls, 0), 0, space.far), affine(misses, space.far, 0))};
}

}  // namespace

SceneModel::SceneModel(Device& device, ParameterStore& store, const Initializer& initializer,
                       const FieldOptions& options, const SceneSpace& space, int samples,
                       std::vector<float> occupied_points, int coarse_samples)
    : field_(device, store, initializer, "scene", options, std::move(occupied_points)),
      space_(space),
      samples_(samples),
      coarse_samples_(coarse_samples) {}

/// The points of the samples; the last sample hides all behind it where the space says so.
void SceneModel::finish(Graph& graph, const Rays& rays, Placed& placed) const {
  const Value world = points_on_rays(rays.origins, rays.directions, placed.samples.depths);
  placed.points = space_.contracted
                      ? contract(world, array_of(space_.centre), space_.radius.maxCoeff())
                      : normalise_to_box(world, array_of(space_.centre), array_of(space_.radius));
  if (!space_.opaque_last) return;
  const std::int64_t samples = placed.samples.depths.shape()[1];
  std::vector<double> extra(samples, 0.0);
  extra.back() = endless;
  placed.samples.deltas =
      add(placed.samples.deltas, graph.constant({samples}, std::span<const double>(extra)));
}

SceneModel::Placed SceneModel::place(Graph& graph, const Rays& rays, int samples,
                                     const RandomKey* random) const {
  Placed placed;
  placed.range = depth_range(graph, space_, rays);
  placed.samples = stratified_samples(placed.range.near, placed.range.far, samples, spacing(),
                                      random ? *random : no_randomness(graph), random != nullptr);
  finish(graph, rays, placed);
  return placed;
}

SceneModel::Placed SceneModel::place_by_weight(Graph& graph, Value planes, const Rays& rays,
                                               const RandomKey* random) const {
  const Placed coarse = place(graph, rays, coarse_samples_, random);
  const Value features = field_.features(graph, planes, coarse.points);
  const Value density = graph.reshape(field_.density(graph, features), coarse.samples.depths.shape());
  const RenderWeights weights = render_weights(density, coarse.samples.deltas, coarse.samples.depths);
  RandomKey key = random ? *random : no_randomness(graph);
  ++key.stream;
  Placed placed;
  placed.range = coarse.range;
  placed.samples = importance_samples(coarse.samples.depths, graph.detach(weights.weight), placed.range.near,
                                      placed.range.far, samples_, key, random != nullptr);
  finish(graph, rays, placed);
  return placed;
}

UnitInputs SceneModel::units(Graph& graph, Value features, const Rays& rays, Output output) const {
  // Cameras are corrected by where things are seen, not by their gloss.
  return field_.units_of_rays(graph, features, {graph.detach(rays.directions)}, output);
}

FieldSamples SceneModel::sample(Graph& graph, Value planes, const Rays& rays, const RandomKey* random,
                                Output output) const {
  const Graph::Scope scope(graph, "scene");
  const Placed placed = coarse_samples_ > 0 ? place_by_weight(graph, planes, rays, random)
                                            : place(graph, rays, samples_, random);
  const auto& [depths, deltas] = placed.samples;
  const Value features = field_.features(graph, planes, placed.points);
  return {.depths = depths,
          .deltas = deltas,
          .range = placed.range,
          .density = graph.reshape(field_.density(graph, features), depths.shape()),
          .units = units(graph, features, rays, output)};
}

FieldSamples SceneModel::sample_occupied(Graph& graph, Value planes, const Rays& rays,
                                         const OccupancyGrid& grid, double threshold, Output output) const {
  const Graph::Scope scope(graph, "scene");
  const Placed placed = place(graph, rays, samples_, nullptr);
  const auto& [depths, deltas] = placed.samples;
  const OccupiedSamples occupied = grid.occupied_samples(graph, placed.points, deltas, threshold);
  const Value points =
      gather_rows(placed.points, graph.with_count(occupied.ids, occupied.count), IdOrder::ascending);
  const Value features = field_.features(graph, planes, points);
  const Value density = field_.density(graph, features);
  const Value rows = graph.reshape(occupied.rows, {depths.elements()});
  FieldSamples samples{.depths = depths,
                       .deltas = deltas,
                       .range = placed.range,
                       .density = graph.reshape(gather_rows(density, rows), depths.shape()),
                       .units = units(graph, features, rays, output)};
  samples.units.rows = occupied.rows;
  return samples;
}

RenderedRays SceneModel::render(Graph& graph, const FieldSamples& samples, double threshold) const {
  const Graph::Scope scope(graph, "scene");
  const RenderWeights weights = render_weights(samples.density, samples.deltas, samples.depths);
  return {rendered_units(samples.units, weights.weight, threshold), sum_channels(weights.weight),
          peak_depth(weights.weight, samples.depths), weights.weight};
}

std::vector<float> occupied_points(const SceneSpace& space, const PointCloud& cloud) {
  std::vector<float> points;
  for (const Eigen::Vector3f& position : cloud.positions) {
    Eigen::Vector3d y = (position.cast<double>() - space.centre).cwiseQuotient(space.radius);
    if (space.contracted) {
      const double m = y.cwiseAbs().maxCoeff();
      y = m <= 1 ? Eigen::Vector3d(y / 2) : Eigen::Vector3d((2 - 1 / m) * y / (2 * m));
    }
    if (y.cwiseAbs().maxCoeff() > 1) continue;
    for (int axis = 0; axis < 3; ++axis) points.push_back(static_cast<float>(y[axis]));
  }
  return points;
}

}  // namespace vivant
