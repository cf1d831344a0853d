#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// What one step of Adam reads and writes. Parameters, gradients and moments are flat buffers [P] in which
/// every parameter starts at a multiple of 64 elements; P is a multiple of 64 and padding has zero gradients.
struct AdamState {
  Value parameters, gradients, first_moments, second_moments;  ///< [P], in external memory or inputs
  Value groups;  ///< u8 [P / 64]: the learning rate of each block of 64 elements; 255: frozen
  Value rates;   ///< [G], learning rates by group
  Value step;    ///< i32 [1]: 1 in the first step
  /// i32 [3], zeros before training, or absent. When a gradient outside of the frozen blocks, or the loss, is
  /// no finite number, it becomes {what (1: gradient, 2: loss), step, element of the gradient}, and from then
  /// on nothing is updated until the host clears it: the parameters stay those of the last good step.
  Value status = {};
  Value loss = {};  ///< [1] or absent: also checked
  Value overflow =
      {};  ///< i32 [1] or absent: when not 0, the status becomes {3, step, -1}, and nothing is updated
};

struct AdamOptions {
  double beta1 = 0.9, beta2 = 0.99, epsilon = 1e-8;
};

/// Records a step of Adam (Kingma and Ba 2015, algorithm 1, with bias correction) as an effect of the graph:
///   m = beta1 m + (1 - beta1) g,  v = beta2 v + (1 - beta2) g^2,
///   p -= rate * (m / (1 - beta1^t)) / (sqrt(v / (1 - beta2^t)) + epsilon).
void adam(const AdamState& state, const AdamOptions& options = {});

}  // namespace vivant
