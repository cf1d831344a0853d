#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// The hidden units of a field, rendered: y [R, N] = the sum over a ray's samples of
/// weight [R, S] * relu(x [R * S, C] . w [C, N] + term), where term is [N] for all rays or [R, N], a row for
/// each. The units of a sample are never stored, and gradients compute them again. Samples that weigh less
/// than `threshold` are left out (they get no gradient either); with 0 none is.
Value weighted_units(Value weight, Value x, Value w, Value term, double threshold = 0);

}  // namespace vivant
