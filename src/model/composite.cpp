#include "vivant/model/composite.hpp"

#include "vivant/ops/concat.hpp"
#include "vivant/ops/merge_samples.hpp"
#include "vivant/ops/peak_depth.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/volume_render.hpp"

namespace vivant {

Intervals intervals_from(const std::string& name) {
  if (name == "own") return Intervals::own;
  if (name == "merged") return Intervals::merged;
  throw UsageError(fmt::format("unknown intervals '{}': use own or merged", name));
}

CompositeRays composite(Graph& graph, const FieldSamples& scene_samples,
                        const HumanFieldSamples& human_samples, Intervals intervals, double threshold) {
  const Graph::Scope scope(graph, "composite");
  const Value order = merge_order(scene_samples.depths, human_samples.depths);
  const Value depths = merge_by(order, scene_samples.depths, human_samples.depths);
  Value deltas = merge_by(order, scene_samples.deltas, human_samples.deltas);
  if (intervals == Intervals::merged) deltas = union_deltas(depths, deltas);
  const RenderWeights weights =
      render_weights(merge_by(order, scene_samples.density, human_samples.density), deltas, depths);
  const Split split = split_by(order, weights.weight, scene_samples.depths.shape()[1]);
  return {.scene_hidden = rendered_units(scene_samples.units, split.a, threshold),
          .human_hidden = rendered_units(human_samples.units, split.b, threshold),
          .scene_alpha = sum_channels(split.a),
          .human_alpha = sum_channels(split.b),
          .scene_depth = peak_depth(split.a, scene_samples.depths),
          .human_depth = peak_depth(split.b, human_samples.depths)};
}

Value composite_output(Graph& graph, const SceneModel& scene, const HumanModel& human,
                       const CompositeRays& rays, Output output) {
  const Value a = scene.field().output(graph, output, rays.scene_hidden, rays.scene_alpha),
              b = human.field().output(graph, output, rays.human_hidden, rays.human_alpha);
  return output == Output::hidden ? concat({a, b}) : add(a, b);
}

}  // namespace vivant
