#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// What the samples of a ray amount to.
struct RenderWeights {
  Value weight;  ///< [R, S]
  Value alpha;   ///< [R, 1], sum_i w_i
  Value depth;   ///< [R, 1], sum_i w_i t_i: divide by alpha for a mean depth
};

/// The weights of the volume rendering equation (the paper's equation 2, Max 1995):
///   w_i = T_i (1 - exp(-density_i delta_i)),  T_i = exp(-sum_{j<i} density_j delta_j)
/// density >= 0, delta >= 0 and depths, all [R, S], front to back. delta 0, density 0 and products so large
/// that nothing passes are all exact. Gradient to density alone: intervals and depths are given.
RenderWeights render_weights(Value density, Value delta, Value depths);

/// sum_i w_i feature_i of every ray: weight [R, S], feature [R * S, C] or [R, S, C] -> [R, C].
///
/// With `ids`, feature [N, C] holds only some of the samples, with or without a device-side count: row k
/// belongs to sample ids[k] of the R * S, and ids ascend (what `compact` gives). The others add nothing.
/// Gradients to weight and feature; no tensor of the size [R, S, C] is made for the first.
Value weighted_sum(Value weight, Value feature, Value ids = {});

struct Rendered {
  Value feature;  ///< [R, C]; absent without features
  Value alpha, depth, weight;
};

/// render_weights, then weighted_sum. They stay two kernels: the weights are 1 / C of the features' bytes, so
/// that fusing them gains nothing, and samples that weigh nothing can be left out in between.
Rendered volume_render(Value density, Value delta, Value depths, Value feature = {});

}  // namespace vivant
