#include "vivant/model/field.hpp"

#include <algorithm>

#include "vivant/graph/executor.hpp"
#include "vivant/ops/concat.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/positional_encoding.hpp"
#include "vivant/ops/triplane_encoding.hpp"
#include "vivant/ops/upsample.hpp"
#include "vivant/ops/weighted_units.hpp"

namespace vivant {
namespace {

constexpr std::string_view encoding_names[] = {"full", "occupied", "vanilla", "mlp"};
constexpr const char* plane_names[] = {"xy", "xz", "yz"};
constexpr std::int64_t normal_width = 3;
enum Head {
  density_head,
  hidden_head,
  direction_head,
  colour_head,
  feature_head,
  feature_hidden_head,
  feature_direction_head
};

}  // namespace

std::string_view name_of(Encoding encoding) { return encoding_names[static_cast<int>(encoding)]; }

Encoding encoding_from(const std::string& name) {
  for (int i = 0; i < static_cast<int>(std::size(encoding_names)); ++i)
    if (encoding_names[i] == name) return static_cast<Encoding>(i);
  throw UsageError(fmt::format("unknown encoding '{}': use full, occupied, vanilla or mlp", name));
}

Field::Field(Device& device, ParameterStore& store, const Initializer& initializer, std::string name,
             const FieldOptions& options, std::vector<float> occupied_points)
    : device_(&device),
      store_(&store),
      name_(std::move(name)),
      options_(options),
      occupied_points_(std::move(occupied_points)) {
  const std::int64_t size = options.plane_size, channels = options.channels;
  std::int64_t width = channels;
  if (options.encoding == Encoding::vanilla) {
    std::vector<float> planes = initializer.normal(name_ + ".planes", 3 * size * size * channels, 0.1);
    for (float& x : planes) x += 1;  // near 1: products of small numbers would not learn
    store.add(name_ + ".planes", {3, size, size, channels}, group_planes, planes);
    for (int scale = 1; scale < options.scales; ++scale) {
      const std::int64_t side = size >> scale;
      store.add(fmt::format("{}.planes{}", name_, 1 << scale), {3 * side, side, channels}, group_planes,
                std::vector<float>(3 * side * side * channels, 0.0f));
    }
  } else if (options.encoding == Encoding::mlp) {
    width = options.mlp_width;
    std::int64_t in = 3 * (1 + 2 * options.position_frequencies);
    for (int layer = 0; layer < options.mlp_layers; ++layer, in = width)
      trunk_.emplace_back(store, initializer, fmt::format("{}.trunk{}", name_, layer), in, width, group_heads,
                          LinearLayer::Options{});
  } else {
    if (options.encoding == Encoding::occupied && occupied_points_.empty())
      fail("the encoding 'occupied' of the {} field needs points: the capture has none", name_);
    for (const char* plane : plane_names)
      unets_.emplace_back(store, initializer, fmt::format("{}.unet_{}", name_, plane),
                          triplane_encoding_channels(options.position_frequencies, !occupied_points_.empty()),
                          options.unet_widths, channels, group_planes);
  }
  const auto head = [&](const char* part, std::int64_t in, std::int64_t out, LinearLayer::Options layer) {
    heads_.emplace_back(store, initializer, name_ + "." + part, in, out, group_heads, layer);
  };
  head("density", width, 1, {.scale = 0.5, .bias = options.density_bias});
  head("hidden", width, hidden_width, {});
  const std::int64_t facing_width = direction_width() + (options.shading ? normal_width : 0);
  head("direction", facing_width, hidden_width, {.has_bias = false});
  head("colour", hidden_width, 3, {.bias = 0.5});
  head("feature", hidden_width, feature_width, {});
  if (!options.feature_hidden) return;
  head("feature_hidden", width, hidden_width, {});
  head("feature_direction", facing_width, hidden_width, {.has_bias = false});
}

Value Field::plane_input(Graph& graph, std::int64_t size, int index) const {
  std::shared_ptr<Buffer>& buffer = plane_inputs_[size];
  const std::int64_t points = static_cast<std::int64_t>(occupied_points_.size()) / 3;
  const std::int64_t width = triplane_encoding_channels(options_.position_frequencies, points > 0);
  const std::size_t plane_bytes = static_cast<std::size_t>(size * size * width) * sizeof(float);
  if (!buffer) {
    Graph once;
    const Value occupied =
        points > 0 ? once.constant({points, 3}, std::span<const float>(occupied_points_)) : Value{};
    const Value encoded = triplane_encoding(once, size, options_.position_frequencies, occupied);
    buffer = std::make_shared<Buffer>(device_->allocate(3 * plane_bytes));
    once.place(encoded, {buffer, 0});
    Executor executor(*device_, once, {encoded});
    executor.run();
    device_->finish();
  }
  return graph.external(fmt::format("{} encoded voxels {}", name_, plane_names[index]),
                        {DType::real, {size, size, width}}, {buffer, index * plane_bytes});
}

Value Field::vanilla_planes(Graph& graph) const {
  const Value finest = store_->value(graph, name_ + ".planes");
  Value coarser;
  for (int scale = options_.scales - 1; scale > 0; --scale) {
    const Value planes = store_->value(graph, fmt::format("{}.planes{}", name_, 1 << scale));
    coarser = upsample2x(coarser ? add(coarser, planes) : planes, Upsampling::bilinear);
  }
  return coarser ? add(finest, graph.reshape(coarser, finest.shape())) : finest;
}

Value Field::planes(Graph& graph, std::int64_t size) const {
  if (size == 0) size = options_.plane_size;
  if (options_.encoding == Encoding::mlp) return {};
  if (options_.encoding == Encoding::vanilla) return vanilla_planes(graph);
  Values planes;
  for (int plane = 0; plane < 3; ++plane) {
    const Graph::Scope scope(graph, name_ + ".unet_" + plane_names[plane]);
    const Value out = unets_[plane](graph, plane_input(graph, size, plane));
    planes.push_back(graph.reshape(out, {1, size * size * options_.channels}));
  }
  return graph.reshape(concat(planes), {3, size, size, options_.channels});
}

Value Field::features(Graph& graph, Value planes, Value points) const {
  if (options_.encoding != Encoding::mlp)
    return triplane_sample(planes, points, options_.combine, options_.gradient_copies);
  std::vector<MlpLayer> layers;
  layers.reserve(trunk_.size());
  for (const LinearLayer& layer : trunk_) layers.push_back(layer.in_mlp(graph));
  return mlp(positional_encoding(points, options_.position_frequencies), layers, Activation::relu);
}

Value Field::density_logit(Graph& graph, Value features) const {
  return heads_[density_head](graph, features);
}

const LinearLayer& Field::hidden_layer(Output output) const {
  return heads_[own_hidden(output) ? feature_hidden_head : hidden_head];
}

std::int64_t Field::direction_width() const { return 3 * (1 + 2 * options_.direction_frequencies); }

Field::FacingInputs Field::facing_inputs(Graph& graph, const Facing& facing, Output output) const {
  const LinearLayer& layer = heads_[own_hidden(output) ? feature_direction_head : direction_head];
  const bool views = facing.directions && options_.direction_frequencies > 0;
  const bool normals = facing.normals && options_.shading;
  if (!views && !normals) return {};
  Values inputs;
  if (views) {
    const Value encoded = positional_encoding(facing.directions, options_.direction_frequencies);
    inputs.push_back(facing.keep ? multiply(encoded, facing.keep) : encoded);
  }
  if (normals) inputs.push_back(facing.normals);
  const std::int64_t first = views ? 0 : direction_width(),
                     rows = (views ? direction_width() : 0) + (normals ? normal_width : 0);
  Value weight = layer.weight(graph);
  if (rows != weight.shape()[0]) weight = slice(weight, 0, first, rows);
  return {inputs.size() > 1 ? concat(inputs) : inputs[0], weight};
}

UnitInputs Field::units_of_rays(Graph& graph, Value features, const Facing& facing, Output output) const {
  const LinearLayer& layer = hidden_layer(output);
  const Value weight = layer.weight(graph), bias = layer.bias(graph);
  const FacingInputs inputs = facing_inputs(graph, facing, output);
  return {features, weight, inputs.x ? linear(inputs.x, inputs.weight, bias) : bias};
}

UnitInputs Field::units_of_samples(Graph& graph, Value features, const Facing& facing, Output output) const {
  const LinearLayer& layer = hidden_layer(output);
  const Value weight = layer.weight(graph), bias = layer.bias(graph);
  const FacingInputs inputs = facing_inputs(graph, facing, output);
  if (!inputs.x) return {features, weight, bias};
  const auto flat = [&](Value w) { return graph.reshape(w, {1, w.elements()}); };
  const Value stacked = concat({flat(weight), flat(inputs.weight)});
  return {concat({features, inputs.x}),
          graph.reshape(stacked, {stacked.elements() / hidden_width, hidden_width}), bias};
}

Value hidden_units(const UnitInputs& inputs) {
  if (inputs.rows && inputs.term.shape().rank() == 2)
    fail("[field] some samples were left out: the rows of the others do not tell their ray");
  return linear(inputs.x, inputs.w, inputs.term, Activation::relu);
}

Value rendered_units(const UnitInputs& inputs, Value weight, double threshold) {
  constexpr double any_weight = 1e-30;  // that of places without a sample is 0
  return weighted_units(weight, inputs.x, inputs.w, inputs.term,
                        inputs.rows ? std::max(threshold, any_weight) : threshold, inputs.rows);
}

Value Field::project(Graph& graph, const LinearLayer& layer, Value hidden, Value alpha) const {
  const Value bias = graph.reshape(layer.bias(graph), {1, layer.bias(graph).elements()});
  return add(linear(hidden, layer.weight(graph)), linear(alpha, bias));
}

Value Field::colour(Graph& graph, Value hidden, Value alpha) const {
  return project(graph, heads_[colour_head], hidden, alpha);
}

Value Field::feature(Graph& graph, Value hidden, Value alpha) const {
  return project(graph, heads_[feature_head], hidden, alpha);
}

Value Field::output(Graph& graph, Output output, Value hidden, Value alpha) const {
  if (output == Output::hidden) return concat({hidden, alpha});
  return output == Output::colour ? colour(graph, hidden, alpha) : feature(graph, hidden, alpha);
}

}  // namespace vivant
