#pragma once
#include <span>

#include "vivant/graph/graph.hpp"
#include "vivant/ops/elementwise.hpp"

namespace vivant {

/// A fully connected layer of an mlp: w [K, N]; b [N] or absent.
struct MlpLayer {
  Value w, b;
};

/// x [..., K0] through all layers, each y = relu(x . w + b) and the last one with `output`, none or relu, in
/// one kernel for each direction: [..., N]. What lies between the layers is written to memory for the
/// gradient alone. Rows may carry a device-side count. Throws Error when layers do not fit together or
/// `output` is another activation.
Value mlp(Value x, std::span<const MlpLayer> layers, Activation output = Activation::none);

}  // namespace vivant
