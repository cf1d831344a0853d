#include "style_network.hpp"

#include "vivant/ops/attention.hpp"
#include "vivant/ops/mean_variance_norm.hpp"

namespace vivant::bench {
namespace {

constexpr std::int64_t widths[] = {StyleNetwork::channels, 128, 64, 64, 3};
constexpr double logit_scale = 0.1;

}  // namespace

StyleNetwork::StyleNetwork(ParameterStore& store, const Initializer& initializer) {
  const auto layer = [&](const std::string& name) {
    return LinearLayer(store, initializer, name, channels, channels, 0, {});
  };
  phi_ = {layer("phi0"), layer("phi1")};
  psi_ = {layer("psi0"), layer("psi1")};
  for (std::size_t i = 0; i + 1 < std::size(widths); ++i)
    decoder_.emplace_back(store, initializer, fmt::format("decoder{}", i), widths[i], widths[i + 1], 0);
}

Value StyleNetwork::operator()(Graph& graph, Value features, const Context& context) const {
  const Value content = phi_[1](graph, phi_[0](graph, features, Activation::relu));
  const Value normal = mean_variance_norm(content, {context.mean, context.deviation});
  const Value queries = graph.reshape(normal, {normal.shape().rows(), channels});
  const AttentionStatistics found =
      attention(queries, context.keys, context.values, {}, {.scale = logit_scale});
  Value x = add(multiply(found.deviation, queries), found.mean);
  x = psi_[1](graph, psi_[0](graph, x, Activation::relu), Activation::relu);
  x = graph.reshape(x, features.shape());
  for (std::size_t i = 0; i < decoder_.size(); ++i)
    x = decoder_[i](graph, x, Padding::zero, i + 1 < decoder_.size() ? Activation::relu : Activation::none);
  return x;
}

}  // namespace vivant::bench
