#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

// The losses of the human field, scalars [1] all, and what they compare. Rays R, points N.

/// colour + (1 - alpha) background: the person over a known background. colour, background [R, 3]; alpha [R,
/// 1].
Value over_background(Value colour, Value alpha, Value background);

/// The paper's L_r: mean |colour - target| over a black background, on the mask's rays alone. target [R, 3];
/// mask [R, 1] is 1 on the person.
Value masked_colour_loss(Value colour, Value mask, Value target);

/// The paper's L_a = mean M |1 - alpha|.
Value alpha_loss(Value alpha, Value mask);

/// Which points the body decides about: a point deeper than `inside_band` is inside, one farther than
/// `outside_band` from the surface is outside, and clothes and hair may be or not be in between.
struct BodyLabels {
  Value inside;   ///< [N, 1] 1 inside, else 0
  Value decided;  ///< [N, 1] 1 inside and outside, 0 in between
};
BodyLabels body_labels(Value signed_distance, double inside_band, double outside_band);

/// L_smpl: mean of |1 - s| over inside points and |s| over outside points. s is the opacity 1 - exp(-density
/// length) of a length in metres, or with length 0 the density itself (as the paper prints it).
Value body_loss(Value density, const BodyLabels& labels, double length);

/// L_edge: the two-valued penalty on the alpha of lines through the canonical box. density [L S, 1] of S
/// points on each of L lines; lengths [L, S] between them, metres.
Value edge_loss(Value density, Value lengths);

/// Neighbouring points of the surface have like colours, and all lie in [0, 1]: mean |a - b| + 5 mean |a -
/// clamp(a)|. Colours a, b [N, 3]. Decides what the back looks like that no camera saw.
Value surface_colour_loss(Value a, Value b);

}  // namespace vivant
