#include "vivant/model/stylizer.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "vivant/ops/attention.hpp"
#include "vivant/ops/concat.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/resample.hpp"
#include "vivant/ops/upsample.hpp"

namespace vivant {
namespace {

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::int64_t C = Stylizer::features;
constexpr std::int64_t psi_channels = 128;
constexpr double first_logit_scale = 0.1;
constexpr double first_output_scale =
    0.02;  // of the decoder's last layer: what it adds to the colour taps is small
constexpr std::int64_t luma_channels = 16;  // the luma term's extra channel, with zeros up to a whole vector

/// Inputs of the decoder's layers, one after the other, then the colours.
std::vector<std::int64_t> decoder_channels(const StylizerOptions& options) {
  if (options.mirrored) return {C, 128, 128, 64, 64, 3};
  return {psi_channels + Stylizer::detail_channels, 96, 64, 64, 3};
}

std::vector<float> identity() {
  const Matrix matrix = Matrix::Identity(C, C);
  return {matrix.data(), matrix.data() + matrix.size()};
}

std::vector<float> random_rotation(const Initializer& initializer, const std::string& name, double factor) {
  const std::vector<float> normal = initializer.normal(name, C * C, 1);
  const Eigen::MatrixXd matrix = Eigen::Map<const Matrix>(normal.data(), C, C).cast<double>();
  const Eigen::MatrixXd rotation = Eigen::HouseholderQR<Eigen::MatrixXd>(matrix).householderQ();
  const Matrix scaled = (factor * rotation).cast<float>();
  return {scaled.data(), scaled.data() + scaled.size()};
}

/// x [h, w, 1] in the first of `luma_channels` channels.
Value luma_lane(Graph& graph, Value x, double factor) {
  std::vector<double> row(luma_channels, 0.0);
  row[0] = factor;
  return linear(x, graph.constant({1, luma_channels}, row));
}

}  // namespace

StylizerOptions StylizerOptions::of_form(const std::string& name) {
  if (name == "guided") return {};
  if (name != "plain" && name != "cosine")
    throw UsageError(fmt::format("unknown form of the stylizer '{}': use guided, plain or cosine", name));
  StylizerOptions options = plain();
  options.cosine = name == "cosine";
  return options;
}

std::string StylizerOptions::form() const {
  if (!mirrored) return "guided";
  return cosine ? "cosine" : "plain";
}

StyleTokens guided_tokens(Graph& graph, Value keys, Value values, Value luma, double weight) {
  if (weight == 0) return {keys, {}, values};
  const Value bias = affine(multiply(luma, luma), -weight);
  return {concat({keys, luma_lane(graph, luma, 2 * weight)}), graph.reshape(bias, {bias.elements()}), values};
}

Value guided_queries(Graph& graph, Value queries, Value luma, double weight) {
  return weight == 0 ? queries : concat({queries, luma_lane(graph, luma, 1)});
}

Value adaptive_normalisation(Value queries, Value normal, const StyleTokens& style,
                             const StylizerOptions& options) {
  Graph& graph = *queries.graph;
  const AttentionStatistics found =
      attention(graph.reshape(queries, {queries.shape().rows(), queries.shape().channels()}), style.keys,
                style.values, style.bias, {.cosine = options.cosine});
  const Value mean = graph.reshape(found.mean, normal.shape()),
              deviation = graph.reshape(found.deviation, normal.shape());
  return add(affine(multiply(deviation, normal), options.deviation_scale), mean);
}

Value blend(Value from, Value to, Value amount) { return add(from, multiply(subtract(to, from), amount)); }

Stylizer::Stylizer(ParameterStore& store, const Initializer& initializer, StylizerOptions options, int group)
    : store_(&store), options_(options) {
  if (options.cosine && options.luma_weight > 0)
    fail("[stylizer] cosine scores know nothing of the luma term: set its weight to 0");
  if (options.mirrored && (options.luma_weight > 0 || options.detail))
    fail("[stylizer] the mirrored decoder goes without the luma term and without detail");
  const auto add = [&](const std::string& layer, const Shape& shape, const std::vector<float>& weights) {
    store.add(name_ + "." + layer + ".weight", shape, group, weights);
    store.add(name_ + "." + layer + ".bias", {shape.channels()}, group, std::vector<float>(shape.channels()));
  };
  const std::vector<float> rotation =
      random_rotation(initializer, name_ + ".rotation", std::sqrt(first_logit_scale));
  if (!options.mirrored)
    for (const char* layer : {"phi0", "phi1"}) add(layer, {C, C}, identity());
  add("value", {C, C}, identity());
  for (const char* layer : {"query", "key"}) add(layer, {C, C}, rotation);
  if (!options.mirrored) {
    add("psi0", {C, C}, initializer.he(name_ + ".psi0", C * C, C));
    add("psi1", {C, psi_channels}, initializer.he(name_ + ".psi1", C * psi_channels, C));
  }
  const std::vector<std::int64_t> channels = decoder_channels(options);
  for (std::size_t i = 0; i + 1 < channels.size(); ++i) {
    const std::int64_t in = channels[i], out = channels[i + 1];
    const std::string layer = fmt::format("decoder{}", i);
    add(layer, {3, 3, in, out},
        initializer.he(name_ + "." + layer, 9 * in * out, 9 * in, out == 3 ? first_output_scale : 1));
  }
}

Value Stylizer::weight(Graph& graph, const std::string& layer) const {
  return store_->value(graph, name_ + "." + layer + ".weight");
}
Value Stylizer::bias(Graph& graph, const std::string& layer) const {
  return store_->value(graph, name_ + "." + layer + ".bias");
}
Value Stylizer::fully_connected(Graph& graph, const std::string& layer, Value x,
                                Activation activation) const {
  // Scores of attention are exponents: an error of a hundredth in them changes what is looked at.
  const bool of_scores = layer == "query" || layer == "key";
  return linear(x, weight(graph, layer), bias(graph, layer), activation,
                of_scores ? Factors::fp32 : Factors::by_mode);
}

Value Stylizer::convolve(Graph& graph, const std::string& layer, Value x, Activation activation) const {
  return conv2d(x, weight(graph, layer), bias(graph, layer), Padding::none, activation);
}

Value Stylizer::content(Graph& graph, Value features) const {
  if (options_.mirrored) return features;
  return fully_connected(graph, "phi1", fully_connected(graph, "phi0", features, Activation::relu));
}

Value Stylizer::luma(Graph& graph, Value rgb) const {
  return linear(rgb, graph.constant({3, 1}, std::vector<double>{0.299, 0.587, 0.114}));
}

Value Stylizer::feature_luma(Value luma) const {
  return resize_bilinear(gaussian_blur(luma, 1), luma.shape()[0] / scale, luma.shape()[1] / scale);
}

Value Stylizer::detail(Value luma) const {
  const Value fine = gaussian_blur(luma, 1), coarse = gaussian_blur(fine, 2);
  return concat({affine(subtract(luma, fine), 4), affine(subtract(fine, coarse), 4)});
}

StyleTokens Stylizer::style_tokens(Graph& graph, Value features, Value luma) const {
  const auto rows = [&](Value x) { return graph.reshape(x, {x.shape().rows(), x.shape().channels()}); };
  const Value keys =
      affine(fully_connected(graph, "key", rows(mean_variance_norm(features))), options_.feature_weight);
  const Value values = fully_connected(graph, "value", rows(features));
  const Value standard_luma = options_.luma_weight > 0 ? rows(mean_variance_norm(luma)) : Value{};
  return guided_tokens(graph, keys, values, standard_luma, options_.luma_weight);
}

ContentStatistics Stylizer::statistics(Value content, Value luma) const {
  return {channel_statistics(content), channel_statistics(luma)};
}

Value Stylizer::attend(Graph& graph, Value content, Value luma, const StyleTokens& style,
                       const ContentStatistics& statistics) const {
  const Value normal = mean_variance_norm(content, statistics.features);
  const Value queries = guided_queries(graph, fully_connected(graph, "query", normal),
                                       mean_variance_norm(luma, statistics.luma), options_.luma_weight);
  const Value limited =
      options_.norm_limit > 0 ? clamp(normal, -options_.norm_limit, options_.norm_limit) : normal;
  return adaptive_normalisation(queries, limited, style, options_);
}

Value Stylizer::decode(Graph& graph, Value features, Value detail) const {
  return options_.mirrored ? decode_mirrored(graph, features) : decode_with_detail(graph, features, detail);
}

Value Stylizer::decode_with_detail(Graph& graph, Value features, Value detail) const {
  const std::int64_t height = scale * (features.shape()[0] - 2 * feature_halo()) + 2 * detail_halo,
                     width = scale * (features.shape()[1] - 2 * feature_halo()) + 2 * detail_halo;
  // psi's first layer is linear up to its ReLU, so it runs before the up-sampling, on a sixteenth of the
  // pixels.
  const Value small = fully_connected(graph, "psi0", features);
  const Value large = resize_bilinear(small, scale * features.shape()[0], scale * features.shape()[1]);
  const std::int64_t border = scale * feature_halo() - detail_halo;
  Value x = activate(crop(large, border, border, height, width), Activation::relu);
  x = fully_connected(graph, "psi1", x, Activation::relu);
  x = concat({x, detail ? detail : graph.zeros({DType::real, {height, width, detail_channels}})});
  for (const char* layer : {"decoder0", "decoder1", "decoder2"}) x = convolve(graph, layer, x);
  return convolve(graph, "decoder3", x, Activation::none);
}

/// VGG-19 up to relu3_1 backwards. Every convolution takes one pixel off the halo, every up-sampling doubles
/// it.
Value Stylizer::decode_mirrored(Graph& graph, Value features) const {
  Value x = upsample2x(convolve(graph, "decoder0", features), Upsampling::nearest);
  x = crop(x, 1, 1, x.shape()[0] - 2, x.shape()[1] - 2);  // of a halo of four, three are read
  x = convolve(graph, "decoder2", convolve(graph, "decoder1", x));
  x = convolve(graph, "decoder3", upsample2x(x, Upsampling::nearest));
  return convolve(graph, "decoder4", x, Activation::none);
}

Value Stylizer::decode_image(Graph& graph, Value features, Value detail) const {
  const auto padded = [](Value image, std::int64_t halo) {
    return crop(image, -halo, -halo, image.shape()[0] + 2 * halo, image.shape()[1] + 2 * halo, true);
  };
  return decode(graph, padded(features, feature_halo()), detail ? padded(detail, detail_halo) : Value{});
}

Value Stylizer::stylise(Graph& graph, Value features, Value rgb, const StyleTokens& style,
                        const ContentStatistics& statistics, Value strength) const {
  const Value light = luma(graph, rgb), plain = content(graph, features);
  const Value stylised = attend(graph, plain, feature_luma(light), style, statistics);
  return decode_image(graph, blend(plain, stylised, strength), options_.detail ? detail(light) : Value{});
}

Value Stylizer::reconstruct(Graph& graph, Value features, Value rgb) const {
  return decode_image(graph, content(graph, features), options_.detail ? detail(luma(graph, rgb)) : Value{});
}

void load_stylizer(ParameterStore& store, const Stylizer& stylizer, const TensorFile& file) {
  const auto named = file.metadata.find("form");
  const std::string form = stylizer.options().form();
  if ((named == file.metadata.end() ? "guided" : named->second) != form)
    fail(
        "{} holds no weights of the form {}: `vivant pretrain-stylizer --form {}` trains some, for "
        "--stylizer",
        file.source, form, form);
  for (const ParameterStore::Parameter& parameter : store.parameters()) {
    if (!parameter.name.starts_with(stylizer.name() + ".")) continue;
    const std::vector<double> values = file.finite_doubles(parameter.name, parameter.shape.extents());
    store.write(parameter.name, std::vector<float>(values.begin(), values.end()));
  }
}

TensorFile save_stylizer(const ParameterStore& store, const Stylizer& stylizer) {
  TensorFile file;
  file.metadata["form"] = stylizer.options().form();
  for (const ParameterStore::Parameter& parameter : store.parameters())
    if (parameter.name.starts_with(stylizer.name() + "."))
      file.tensors[parameter.name] =
          HostTensor(parameter.shape.extents(), std::span<const float>(store.read(parameter.name)));
  return file;
}

}  // namespace vivant
