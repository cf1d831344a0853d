#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Weights A [N, M] of queries q [N, D] over keys k [M, D]; s = scale q . k + bias:
///   softmax  A = e^s / sum_j e^s
///   cosine   A = (s + 1) / sum_j (s + 1), of q and k scaled to length 1
struct AttentionOptions {
  bool cosine = false;
  double scale = 1;
};

/// A . values: q [N, D], k [M, D], values [M, E], bias [M] or absent -> [N, E]. Streams over the keys: A is
/// never stored, gradients recompute it. k and values may share a device-side count of live rows; bias then
/// covers all.
Value attend(Value q, Value k, Value values, Value bias = {}, const AttentionOptions& options = {});

/// The mean and the deviation of the values that each query attends to, [N, C].
struct AttentionStatistics {
  Value mean, deviation;
};

/// Adaptive attention normalisation (Liu et al. 2021, AdaAttN, equations 4 to 6): mean = A v and
/// deviation = sqrt(max(0, A v^2 - mean^2)), with gradient 0 where the deviation is 0. v [M, C] is taken
/// relative to its channel means, which leaves the deviation unchanged and keeps the difference of squares
/// accurate.
AttentionStatistics attention(Value q, Value k, Value v, Value bias = {},
                              const AttentionOptions& options = {});

/// Rows of x [..., C] scaled to length 1: x / sqrt(x . x + 1e-12).
Value normalise_rows(Value x);

}  // namespace vivant
