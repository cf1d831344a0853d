#include "vivant/nn/modules.hpp"

namespace vivant {

LinearLayer::LinearLayer(ParameterStore& store, const Initializer& initializer, std::string name,
                         std::int64_t in, std::int64_t out, int group, Options options)
    : store_(&store), name_(std::move(name)), has_bias_(options.has_bias) {
  store.add(name_ + ".weight", {in, out}, group,
            initializer.he(name_ + ".weight", in * out, in, options.scale));
  if (has_bias_)
    store.add(name_ + ".bias", {out}, group, std::vector<float>(out, static_cast<float>(options.bias)));
}

Value LinearLayer::bias(Graph& graph) const {
  return has_bias_ ? store_->value(graph, name_ + ".bias") : Value{};
}

Value LinearLayer::operator()(Graph& graph, Value x, Activation activation) const {
  return linear(x, weight(graph), bias(graph), activation);
}

ConvLayer::ConvLayer(ParameterStore& store, const Initializer& initializer, std::string name, std::int64_t in,
                     std::int64_t out, int group)
    : store_(&store), name_(std::move(name)) {
  store.add(name_ + ".weight", {3, 3, in, out}, group,
            initializer.he(name_ + ".weight", 9 * in * out, 9 * in));
  store.add(name_ + ".bias", {out}, group, std::vector<float>(out, 0.0f));
}

Value ConvLayer::operator()(Graph& graph, Value x, Padding padding, Activation activation) const {
  return conv2d(x, store_->value(graph, name_ + ".weight"), store_->value(graph, name_ + ".bias"), padding,
                activation);
}

}  // namespace vivant
