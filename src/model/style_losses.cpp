#include "vivant/model/style_losses.hpp"

#include <algorithm>
#include <cmath>

#include "vivant/ops/linear.hpp"
#include "vivant/ops/loss.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/resample.hpp"

namespace vivant {
namespace {

constexpr double logit_scale_times_channels = 25.6;  // gives the stylizer's 0.1 for its 256 channels
constexpr double covariance_weight = 10;             // beside the means of colours, whose errors are larger

Value mean_square(Value x) { return mean(multiply(x, x)); }

Value sum_of(const Values& terms) {
  Value total = terms.front();
  for (std::size_t i = 1; i < terms.size(); ++i) total = add(total, terms[i]);
  return total;
}

Value scaled_error(Value a, Value b, const std::vector<float>& scale) {
  return mean_square(
      multiply(subtract(a, b), a.graph->constant({static_cast<std::int64_t>(scale.size())}, scale)));
}

Value statistics_error(const ChannelStatistics& a, const ChannelStatistics& b,
                       const std::vector<float>& scale) {
  return add(scaled_error(a.mean, b.mean, scale), scaled_error(a.deviation, b.deviation, scale));
}

Value rows(Value x) { return x.graph->reshape(x, {x.shape().rows(), x.shape().channels()}); }

/// Standardised luma at the size of `features`.
Value luma_for(Value luma, Value features) {
  return mean_variance_norm(resize_bilinear(luma, features.shape()[0], features.shape()[1]));
}

/// Tokens without parameters: the features themselves. luma is not read with luma_weight 0.
StyleTokens parameter_free_tokens(Graph& graph, const Stylizer& stylizer, Value features, Value luma) {
  const double weight = stylizer.options().luma_weight;
  return guided_tokens(graph, rows(mean_variance_norm(features)), rows(features),
                       weight > 0 ? rows(luma_for(luma, features)) : Value{}, weight);
}

/// The parameter-free AdaAttN target of a layer.
Value local_target(Graph& graph, const Stylizer& stylizer, Value features, Value luma,
                   const StyleTokens& style) {
  const StylizerOptions& options = stylizer.options();
  const Value normal = mean_variance_norm(features);
  const double scale =
      options.feature_weight * logit_scale_times_channels / static_cast<double>(features.shape().channels());
  const Value queries =
      guided_queries(graph, affine(normal, scale), luma_for(luma, features), options.luma_weight);
  return adaptive_normalisation(queries, normal, style, options);
}

struct ColourMoments {
  Value mean, covariance;
};
ColourMoments colour_moments(Value rgb) {
  const Value centre = affine(sum_rows(rgb), 1.0 / static_cast<double>(rgb.shape().rows()));
  const Value centred = subtract(rgb, centre);
  return {centre, affine(outer_sum(centred, centred), 1.0 / static_cast<double>(rgb.shape().rows()))};
}

/// Calls f with every value of a target, in a fixed order.
template <typename Target, typename F>
void for_each_value(Target& target, F f) {
  for (auto& layer : target.layers) f(layer.mean), f(layer.deviation);
  const auto visit = [&](auto& tokens) { f(tokens.keys), f(tokens.bias), f(tokens.values); };
  visit(target.tokens);
  for (auto& tokens : target.deep) visit(tokens);
  f(target.colour_mean), f(target.colour_covariance), f(target.features);
}

}  // namespace

StyleFeatures style_features(const Vgg19& vgg, Value image, std::size_t layers) {
  const std::array<std::string, 5> names = {"relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"};
  const std::map<std::string, Value> found = vgg.features(image, {names.begin(), names.begin() + layers});
  StyleFeatures features;
  for (std::size_t i = 0; i < layers; ++i) features[i] = found.at(names[i]);
  return features;
}

std::vector<float> channel_scale(const std::vector<double>& variance) {
  std::vector<double> sorted = variance;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  const double floor = 0.3 * sorted[sorted.size() / 2];
  std::vector<float> scale(variance.size());
  std::transform(variance.begin(), variance.end(), scale.begin(),
                 [&](double v) { return static_cast<float>(1 / std::sqrt(v + floor)); });
  return scale;
}

Value reconstruction_loss(Value image, Value target, const StyleFeatures& image_features,
                          const StyleFeatures& target_features, const ReconstructionWeights& weights) {
  Values terms = {affine(l2_loss(image, target), weights.squared),
                  affine(l1_loss(image, target), weights.absolute)};
  for (std::size_t i = 0; i < weights.features.size(); ++i)
    if (image_features[i])
      terms.push_back(affine(l2_loss(image_features[i], target_features[i]), weights.features[i]));
  return sum_of(terms);
}

Values StyleTarget::values() const {
  Values all;
  for_each_value(*this, [&](const Value& value) {
    if (value) all.push_back(value);
  });
  return all;
}

StyleTarget StyleTarget::as_inputs(Graph& graph) const {
  StyleTarget inputs = *this;
  int count = 0;
  for_each_value(inputs, [&](Value& value) {
    if (value) value = graph.input(fmt::format("style {}", count++), value.shape());
  });
  return inputs;
}

StyleTarget style_target(Graph& graph, const Stylizer& stylizer, Value rgb, const StyleFeatures& features) {
  StyleTarget target;
  for (std::size_t i = 0; i < features.size(); ++i) target.layers[i] = channel_statistics(features[i]);
  const Value luma = stylizer.luma(graph, rgb);
  if (stylizer.options().mirrored)
    target.features = features[2];
  else
    target.tokens = stylizer.style_tokens(graph, features[2], stylizer.feature_luma(luma));
  for (std::size_t i = 0; i < target.deep.size(); ++i)
    target.deep[i] = parameter_free_tokens(graph, stylizer, features[3 + i], luma);
  const ColourMoments colours = colour_moments(rgb);
  target.colour_mean = colours.mean;
  target.colour_covariance = colours.covariance;
  return target;
}

StyleTokens StyleTarget::tokens_of(Graph& graph, const Stylizer& stylizer) const {
  return features ? stylizer.style_tokens(graph, features, {}) : tokens;
}

Value StyleLosses::total(const StyleWeights& weights) const {
  return sum_of({affine(global, weights.global), affine(first_layer, weights.first_layer),
                 affine(local, weights.local), affine(content, weights.content),
                 affine(colours, weights.colours), affine(gamut, weights.gamut)});
}

StyleLosses style_losses(Graph& graph, const Stylizer& stylizer, Value image, const StyleFeatures& features,
                         const StyleContent& content, const StyleTarget& target,
                         const ChannelScales& scales) {
  StyleLosses losses;
  // What is trained must not be its own target.
  const Value stylised = target.features
                             ? local_target(graph, stylizer, content.features[2], content.luma,
                                            parameter_free_tokens(graph, stylizer, target.features, {}))
                             : content.stylised;
  Values global, local = {scaled_error(features[2], graph.detach(stylised), scales[2])}, structure;
  for (std::size_t i = 1; i < features.size(); ++i)
    global.push_back(statistics_error(channel_statistics(features[i]), target.layers[i], scales[i]));
  for (std::size_t i = 3; i < features.size(); ++i) {
    const Value aim = local_target(graph, stylizer, content.features[i], content.luma, target.deep[i - 3]);
    local.push_back(scaled_error(features[i], graph.detach(aim), scales[i]));
    structure.push_back(
        mean_square(subtract(mean_variance_norm(features[i]), mean_variance_norm(content.features[i]))));
  }
  losses.global = sum_of(global);
  losses.first_layer = statistics_error(channel_statistics(features[0]), target.layers[0], scales[0]);
  losses.local = sum_of(local);
  losses.content = sum_of(structure);
  const ColourMoments colours = colour_moments(image);
  losses.colours = add(l2_loss(colours.mean, target.colour_mean),
                       affine(l2_loss(colours.covariance, target.colour_covariance), covariance_weight));
  losses.gamut = add(mean(activate(affine(image, 1, -1), Activation::relu)),
                     mean(activate(affine(image, -1), Activation::relu)));
  return losses;
}

}  // namespace vivant
