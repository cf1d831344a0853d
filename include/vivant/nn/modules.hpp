#pragma once
#include <string>

#include "vivant/nn/parameters.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/mlp.hpp"

namespace vivant {

/// A fully connected layer: parameters `<name>.weight` [in, out] and `<name>.bias` [out].
class LinearLayer {
 public:
  struct Options {
    double scale = 1;  ///< factor on the He initialisation
    double bias = 0;   ///< first value of the bias
    bool has_bias = true;
  };
  LinearLayer(ParameterStore& store, const Initializer& initializer, std::string name, std::int64_t in,
              std::int64_t out, int group, Options options);
  Value operator()(Graph& graph, Value x, Activation activation = Activation::none) const;
  Value weight(Graph& graph) const { return store_->value(graph, name_ + ".weight"); }
  Value bias(Graph& graph) const;
  MlpLayer in_mlp(Graph& graph) const { return {weight(graph), bias(graph)}; }

 private:
  ParameterStore* store_;
  std::string name_;
  bool has_bias_;
};

/// A 3x3 convolution with stride 1: parameters `<name>.weight` [3, 3, in, out] and `<name>.bias` [out].
class ConvLayer {
 public:
  ConvLayer(ParameterStore& store, const Initializer& initializer, std::string name, std::int64_t in,
            std::int64_t out, int group);
  Value operator()(Graph& graph, Value x, Padding padding, Activation activation) const;

 private:
  ParameterStore* store_;
  std::string name_;
};

}  // namespace vivant
