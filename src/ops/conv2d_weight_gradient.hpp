#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// The gradient [3, 3, CI, CO] of the weights of a 3x3 convolution of x [H, W, CI], `pad` pixels (mirrored
/// with `reflect`) around it, from the gradient of its output, `grad` [H + 2 pad - 2, W + 2 pad - 2, CO].
Value conv2d_weight_gradient(Value x, Value grad, int pad, bool reflect);

}  // namespace vivant
