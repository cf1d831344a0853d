#pragma once
#include "vivant/nn/modules.hpp"
#include "workload.hpp"

namespace vivant::bench {

/// The network of the style workloads: phi (two fully connected layers), attention over the tokens of a
/// style, psi (two more), then 3x3 convolutions 256-128-64-64-3. Everything at the size of the feature map.
class StyleNetwork {
 public:
  static constexpr std::int64_t channels = 256;

  StyleNetwork(ParameterStore& store, const Initializer& initializer);

  /// What comes from outside of the network.
  struct Context {
    Value mean, deviation;  ///< [256], of phi's output
    Value keys, values;     ///< [tokens, 256]
  };
  /// [H, W, 256] -> [H, W, 3].
  Value operator()(Graph& graph, Value features, const Context& context) const;

 private:
  std::vector<LinearLayer> phi_, psi_;
  std::vector<ConvLayer> decoder_;
};

}  // namespace vivant::bench
