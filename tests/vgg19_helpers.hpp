#pragma once
#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "vivant/io/tensor_file.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/max_pool2d.hpp"

namespace vivant {

inline std::vector<float> to_unit(const std::uint8_t* pixels, std::size_t count) {
  std::vector<float> image(count);
  for (std::size_t i = 0; i < count; ++i) image[i] = static_cast<float>(pixels[i]) / 255.0f;
  return image;
}

inline double relative_error(const std::vector<double>& got, const std::vector<double>& want) {
  REQUIRE(got.size() == want.size());
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    difference += (got[i] - want[i]) * (got[i] - want[i]);
    norm += want[i] * want[i];
  }
  return std::sqrt(difference / norm);
}

/// [C, H, W] as [H, W, C].
inline std::vector<double> channels_last(const HostTensor& tensor) {
  const std::vector<double> values = tensor.as_doubles();
  const std::size_t channels = tensor.shape[0], pixels = values.size() / channels;
  std::vector<double> moved(values.size());
  for (std::size_t c = 0; c < channels; ++c)
    for (std::size_t p = 0; p < pixels; ++p) moved[p * channels + c] = values[c * pixels + p];
  return moved;
}

/// A convolution's weights [out, in, side, side] and bias as a file holds them, as [side, side, in, out].
struct PublishedConvolution {
  PublishedConvolution(const TensorFile& file, const std::string& name)
      : bias(file.tensors.at(name + ".bias").as_doubles()) {
    const HostTensor& w = file.tensors.at(name + ".weight");
    const std::vector<double> oihw = w.as_doubles();
    const std::int64_t out = w.shape[0], in = w.shape[1], side = w.shape[2];
    shape = {side, side, in, out};
    weights.resize(oihw.size());
    for (std::int64_t o = 0; o < out; ++o)
      for (std::int64_t i = 0; i < in; ++i)
        for (std::int64_t tap = 0; tap < side * side; ++tap)
          weights[(tap * in + i) * out + o] = oihw[(o * in + i) * side * side + tap];
  }
  Value apply(Value x, Activation activation) const {
    return conv2d(x, x.graph->constant(shape, std::span<const double>(weights)),
                  x.graph->constant({shape[3]}, std::span<const double>(bias)), Padding::reflect, activation);
  }
  /// A 1x1 convolution of rows [N, in], with factors in fp32 in every mode.
  Value project_exactly(Value x) const {
    return linear(x, x.graph->constant({shape[2], shape[3]}, std::span<const double>(weights)),
                  x.graph->constant({shape[3]}, std::span<const double>(bias)), Activation::none,
                  Factors::fp32);
  }
  Shape shape;
  std::vector<double> weights, bias;
};

/// relu1_1, relu2_1 and relu3_1 of the published activation-normalised VGG-19, from an RGB image in [0, 1].
inline std::map<std::string, Value> published_encoder(const TensorFile& file, Value image) {
  const auto layer = [&](const std::string& name, Value x) {
    return PublishedConvolution(file, name).apply(x, name == "conv0_0" ? Activation::none : Activation::relu);
  };
  const Value relu1_1 = layer("conv1_1", layer("conv0_0", image));
  const Value relu2_1 = layer("conv2_1", max_pool2d(layer("conv1_2", relu1_1)));
  const Value relu3_1 = layer("conv3_1", max_pool2d(layer("conv2_2", relu2_1)));
  return {{"relu1_1", relu1_1}, {"relu2_1", relu2_1}, {"relu3_1", relu3_1}};
}

}  // namespace vivant
