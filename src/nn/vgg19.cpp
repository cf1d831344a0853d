#include "vivant/nn/vgg19.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "vivant/graph/executor.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/max_pool2d.hpp"

namespace vivant {
namespace {

struct Convolution {
  const char* name;  // conv<name>, relu<name>
  std::int64_t channels;
  bool pooled_before;
};
constexpr Convolution convolutions[] = {
    {"1_1", 64, false},  {"1_2", 64, false},  {"2_1", 128, true},  {"2_2", 128, false}, {"3_1", 256, true},
    {"3_2", 256, false}, {"3_3", 256, false}, {"3_4", 256, false}, {"4_1", 512, true},  {"4_2", 512, false},
    {"4_3", 512, false}, {"4_4", 512, false}, {"5_1", 512, true}};

// The network was trained on BGR in 0..255 minus the mean colour.
constexpr double colour_scale = 255;
constexpr std::array<double, 3> mean_bgr = {103.939, 116.779, 123.68};

using Weights = std::vector<float>;  // [3, 3, in, out]

/// The weights of one layer, codebook[weight_index], from the file's [out, in, 3, 3] to [3, 3, in, out].
Weights decode(const TensorFile& file, const std::string& name, std::int64_t in, std::int64_t out) {
  const HostTensor& index = file.at(name + ".weight_index", {out, in, 3, 3});
  if (index.type != ElementType::u8)
    fail("{}: {}.weight_index is {}, it should be U8", file.source, name, element_name(index.type));
  const std::vector<double> codebook = file.finite_doubles(name + ".codebook", {256});
  Weights weights(static_cast<std::size_t>(9 * in * out));
  for (std::int64_t o = 0; o < out; ++o)
    for (std::int64_t i = 0; i < in; ++i)
      for (std::int64_t tap = 0; tap < 9; ++tap)
        weights[(tap * in + i) * out + o] =
            static_cast<float>(codebook[std::to_integer<int>(index.bytes[(o * in + i) * 9 + tap])]);
  return weights;
}

/// Turns a first layer for BGR in 0..255 minus the mean into one for RGB in [0, 1]. Exact with reflection
/// padding, where the border shows colours too.
void fold_colours(Weights& weights, std::vector<double>& bias) {
  const auto out = static_cast<std::int64_t>(bias.size());
  for (std::int64_t tap = 0; tap < 9; ++tap)
    for (std::int64_t o = 0; o < out; ++o) {
      float* w = weights.data() + tap * 3 * out + o;
      for (std::int64_t c = 0; c < 3; ++c) bias[o] -= w[c * out] * mean_bgr[c];
      std::swap(w[0], w[2 * out]);
      for (std::int64_t c = 0; c < 3; ++c) w[c * out] = static_cast<float>(w[c * out] * colour_scale);
    }
}

/// Divides a layer by its own mean activations and takes those of the layer before as its input's.
void normalise(Weights& weights, std::vector<double>& bias, const std::vector<double>& mean_in,
               const std::vector<double>& mean_out) {
  const std::size_t in = mean_in.size(), out = mean_out.size();
  for (std::size_t e = 0; e < weights.size(); ++e)
    weights[e] = static_cast<float>(weights[e] * mean_in[e / out % in] / mean_out[e % out]);
  for (std::size_t o = 0; o < out; ++o) bias[o] /= mean_out[o];
}

std::vector<double> activation_mean(const TensorFile& file, const std::string& name, std::int64_t out) {
  const std::vector<double> mean = file.finite_doubles(name + ".activation_mean", {out});
  if (std::any_of(mean.begin(), mean.end(), [](double m) { return m <= 0; }))
    fail("{}: {}.activation_mean has a value that is not positive", file.source, name);
  return mean;
}

/// RGB in [0, 1] to what the plain network reads.
Value plain_colours(Value image) {
  std::vector<double> matrix(9, 0.0), shift(3);
  for (int c = 0; c < 3; ++c) {
    matrix[(2 - c) * 3 + c] = colour_scale;
    shift[c] = -mean_bgr[c];
  }
  Graph& graph = *image.graph;
  return linear(image, graph.constant({3, 3}, std::span<const double>(matrix)),
                graph.constant({3}, std::span<const double>(shift)));
}

/// Lays tensors of floats out one behind the other.
class ByteLayout {
 public:
  explicit ByteLayout(std::size_t alignment) : alignment_(alignment) {}
  std::size_t add(std::int64_t elements) {
    const std::size_t offset = size_;
    size_ += (static_cast<std::size_t>(elements) * sizeof(float) + alignment_ - 1) / alignment_ * alignment_;
    return offset;
  }
  std::size_t size() const { return size_; }

 private:
  std::size_t alignment_, size_ = 0;
};

}  // namespace

Vgg19::Vgg19(Device& device, Form form) : Vgg19(device, form, asset_path("vgg19.safetensors")) {}

Vgg19::Vgg19(Device& device, Form form, const std::filesystem::path& path) : device_(&device), form_(form) {
  const TensorFile file = read_safetensors(path);
  std::vector<Weights> weights, biases;
  std::vector<double> mean_in(3, 1.0);
  for (const Convolution& convolution : convolutions) {
    const std::string name = std::string("conv") + convolution.name;
    const std::int64_t in = layers_.empty() ? 3 : layers_.back().weight[3], out = convolution.channels;
    weights.push_back(decode(file, name, in, out));
    std::vector<double> bias = file.finite_doubles(name + ".bias", {out});
    if (form == Form::normalised) {
      if (layers_.empty()) fold_colours(weights.back(), bias);
      const std::vector<double> mean_out = activation_mean(file, name, out);
      normalise(weights.back(), bias, mean_in, mean_out);
      mean_in = mean_out;
    }
    biases.emplace_back(bias.begin(), bias.end());
    layers_.emplace_back().weight = {3, 3, in, out};
  }
  upload(weights, biases);
}

void Vgg19::upload(const std::vector<Weights>& weights, const std::vector<Weights>& biases) {
  ByteLayout layout(device_->alignment());
  for (Layer& layer : layers_) {
    layer.weight_offset = layout.add(layer.weight.elements());
    layer.bias_offset = layout.add(layer.weight[3]);
  }
  weights_ = std::make_shared<Buffer>(device_->allocate(layout.size()));
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    device_->write(*weights_, weights[i].data(), weights[i].size() * sizeof(float), layers_[i].weight_offset);
    device_->write(*weights_, biases[i].data(), biases[i].size() * sizeof(float), layers_[i].bias_offset);
  }
}

const Vgg19::Packed& Vgg19::packed(std::size_t layer, bool transposed, bool winograd) const {
  const auto [entry, fresh] = packed_.try_emplace({layer, transposed, winograd});
  if (!fresh) return entry->second;
  Graph graph;
  const Value w =
      graph.external("w", {DType::real, layers_[layer].weight}, {weights_, layers_[layer].weight_offset});
  const Value packed = winograd ? pack_winograd(w, transposed) : pack_weights(w, transposed);
  entry->second.shape = packed.shape();
  entry->second.buffer = std::make_shared<Buffer>(
      device_->allocate(static_cast<std::size_t>(packed.elements()) * sizeof(float)));
  graph.place(packed, {entry->second.buffer, 0});
  Executor(*device_, graph, {packed}).run();
  return entry->second;
}

void Vgg19::use_packed(Value w, std::size_t layer, const std::string& name, const Shape& image) const {
  for (const bool transposed : {false, true}) {
    const std::int64_t mirrored =
        transposed && form_ == Form::normalised ? 2 : 0;  // mirroring's gradient has a border
    const bool winograd = suits_winograd(w.shape(), transposed, image[0] + mirrored, image[1] + mirrored);
    const Packed& own = packed(layer, transposed, winograd);
    const Value value = w.graph->external(name + (transposed ? ".transposed" : ".packed"),
                                          {DType::real, own.shape}, {own.buffer, 0});
    winograd ? use_packed_winograd(w, value, transposed) : use_packed_weights(w, value, transposed);
  }
}

std::vector<std::string> Vgg19::layer_names() {
  std::vector<std::string> names;
  for (const Convolution& convolution : convolutions) names.push_back(std::string("relu") + convolution.name);
  return names;
}

std::map<std::string, Value> Vgg19::features(Value image, const std::vector<std::string>& layers) const {
  const std::vector<std::string> names = layer_names();
  std::size_t depth = 0;
  for (const std::string& layer : layers) {
    const auto found = std::find(names.begin(), names.end(), layer);
    if (found == names.end()) fail("VGG-19 has no layer '{}': relu1_1 to relu5_1 exist", layer);
    depth = std::max(depth, static_cast<std::size_t>(found - names.begin()) + 1);
  }
  Graph& graph = *image.graph;
  const Graph::Scope scope(graph, "vgg19");
  std::map<std::string, Value> features;
  Value x = form_ == Form::plain ? plain_colours(image) : image;
  const Padding padding = form_ == Form::plain ? Padding::zero : Padding::reflect;
  for (std::size_t i = 0; i < depth; ++i) {
    const Layer& layer = layers_[i];
    const std::string name = "vgg19." + names[i];
    const auto external = [&](const std::string& part, const Shape& shape, std::size_t offset) {
      return graph.external(name + part, {DType::real, shape}, {weights_, offset});
    };
    const Value w = external(".weight", layer.weight, layer.weight_offset);
    const Value b = external(".bias", {layer.weight[3]}, layer.bias_offset);
    if (convolutions[i].pooled_before) x = max_pool2d(x);
    use_packed(w, i, name, x.shape());
    x = conv2d(x, w, b, padding, Activation::relu);
    if (std::find(layers.begin(), layers.end(), names[i]) != layers.end()) features[names[i]] = x;
  }
  return features;
}

}  // namespace vivant
