#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// The hidden units of a field, rendered: y [R, N] = the sum over a ray's samples of
/// weight [R, S] * relu(x [R * S, C] . w [C, N] + term), where term is [N] for all rays or [R, N], a row for
/// each. The units of a sample are never stored, and gradients compute them again. Samples that weigh less
/// than `threshold` are left out (they get no gradient either); with 0 none is.
///
/// With `rows` i32 [R, S], which needs a threshold above 0, x [K, C] holds only some of the samples (see
/// occupied_samples): rows[r, s] is the row of a sample; the others must weigh nothing. Then w and term
/// alone have gradients.
Value weighted_units(Value weight, Value x, Value w, Value term, double threshold = 0, Value rows = {});

}  // namespace vivant
