#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// The order of two fields' samples on the same rays by depth: depths_a [R, A] and depths_b [R, B], each
/// ascending, -> i32 [R, A + B], indices into a's then b's samples; at equal depths a comes first. Not
/// differentiable: gradients go through the fixed permutation.
Value merge_order(Value depths_a, Value depths_b);

/// Values of the samples, a [R, A] and b [R, B], in the merged order: [R, A + B].
Value merge_by(Value order, Value a, Value b);

struct Split {
  Value a, b;
};
/// The inverse of merge_by: `a_count` samples of the first field, the rest of the second.
Split split_by(Value order, Value merged, std::int64_t a_count);

/// The paper's letter for the composite: intervals over the union of the samples. depths and deltas [R, S] in
/// merged order -> [R, S], the distance to the next sample; the last keeps its own, and samples of length 0
/// stay empty. Not differentiable.
Value union_deltas(Value depths, Value deltas);

}  // namespace vivant
