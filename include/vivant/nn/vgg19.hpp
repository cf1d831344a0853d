#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "vivant/graph/graph.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// The convolutions of VGG-19 up to relu5_1 (Simonyan and Zisserman 2015) with frozen weights: the features
/// that losses and style transfer are made of. The weights are decoded once, into device memory that all
/// graphs share.
class Vgg19 {
 public:
  /// plain: the published network, zero padding. normalised: reflection padding and channels scaled so that
  /// every ReLU's mean activation on natural images is 1 (as in Gatys et al. 2016); what all losses use.
  enum class Form { plain, normalised };

  /// Reads a weights file in the layout of assets/README.md; the plain form needs no activation means.
  /// Throws Error for a file that does not fit.
  Vgg19(Device& device, Form form, const std::filesystem::path& file);
  /// The file that comes with the program.
  explicit Vgg19(Device& device, Form form = Form::normalised);

  /// Records the layers up to the last one asked for and returns them by name. `image` [H, W, 3] is RGB in
  /// [0, 1]; relu<k>_<j> has 1 / 2^(k-1) of its size, rounded down, and 64, 128, 256, 512, 512 channels for k
  /// = 1..5. H and W are at least 2^k for the reflection to exist. Gradients flow to the image.
  std::map<std::string, Value> features(Value image, const std::vector<std::string>& layers) const;

  /// "relu1_1", "relu1_2", ... "relu5_1".
  static std::vector<std::string> layer_names();

 private:
  /// Weights [3, 3, in, out] and bias [out] in `weights_`.
  struct Layer {
    Shape weight;
    std::size_t weight_offset = 0, bias_offset = 0;  // bytes
  };
  struct Packed {
    Shape shape;
    std::shared_ptr<Buffer> buffer;
  };
  void upload(const std::vector<std::vector<float>>& weights, const std::vector<std::vector<float>>& biases);
  /// A layer's packed weights, made when they are first asked for.
  const Packed& packed(std::size_t layer, bool transposed, bool winograd) const;
  /// Makes the convolution of `image` by w, and its gradient, read the layer's packed weights.
  void use_packed(Value w, std::size_t layer, const std::string& name, const Shape& image) const;

  Device* device_;
  Form form_;
  std::vector<Layer> layers_;
  std::shared_ptr<Buffer> weights_;
  mutable std::map<std::tuple<std::size_t, bool, bool>, Packed>
      packed_;  ///< by layer, transposed, Winograd's
};

}  // namespace vivant
