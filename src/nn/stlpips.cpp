#include "vivant/nn/stlpips.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "vivant/io/assets.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/ops/attention.hpp"
#include "vivant/ops/concat.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/resample.hpp"

namespace vivant {
namespace {

struct Convolution {
  const char* name;
  std::int64_t side, in, out;
};
constexpr std::array<Convolution, 5> convolutions = {{{"conv1", 11, 3, 64},
                                                      {"conv2", 5, 64, 192},
                                                      {"conv3", 3, 192, 384},
                                                      {"conv4", 3, 384, 256},
                                                      {"conv5", 3, 256, 256}}};
constexpr std::array<double, 3> shift = {-.030, -.088, -.188}, scale = {.458, .448, .450};

/// x [H, W, C] with `border` more pixels on each side, zeros or mirrored at the outermost pixels' centres.
Value padded(Value x, int border, bool mirrored) {
  const std::int64_t height = x.shape()[0], width = x.shape()[1], channels = x.shape()[2];
  const auto inside = [&](std::int64_t i, std::int64_t extent) {
    if (i >= 0 && i < extent) return i;
    return mirrored ? (i < 0 ? -i : 2 * extent - 2 - i) : -1;
  };
  std::vector<std::int32_t> ids;
  for (std::int64_t i = -border; i < height + border; ++i)
    for (std::int64_t j = -border; j < width + border; ++j) {
      const std::int64_t row = inside(i, height), column = inside(j, width);
      ids.push_back(row < 0 || column < 0 ? -1 : static_cast<std::int32_t>(row * width + column));
    }
  Graph& graph = *x.graph;
  const auto count = static_cast<std::int64_t>(ids.size());
  const Value rows = gather_rows(graph.reshape(x, {height * width, channels}),
                                 graph.constant({count}, std::span<const std::int32_t>(ids)));
  return graph.reshape(rows, {height + 2 * border, width + 2 * border, channels});
}

/// [1 2 1] / 4 on both axes over mirrored borders of two pixels, every second pixel: two averages of
/// neighbours, of which the second is a reduction to half the size.
Value blur_and_halve(Value x) {
  const Value wide = padded(x, 2, true);
  const std::int64_t height = (wide.shape()[0] - 1) / 2 * 2, width = (wide.shape()[1] - 1) / 2 * 2;
  Value sum;
  for (const int dy : {0, 1})
    for (const int dx : {0, 1}) {
      const Value part = crop(wide, dy, dx, height, width);
      sum = sum ? add(sum, part) : part;
    }
  return resize_bilinear(affine(sum, 0.25), height / 2, width / 2);
}

Value larger(Value a, Value b) { return add(a, activate(subtract(b, a), Activation::relu)); }

/// The largest of each 3 x 3 window that lies inside.
Value max_of_nine(Value x) {
  const std::int64_t height = x.shape()[0], width = x.shape()[1];
  const auto columns = [&](int j) { return crop(x, 0, j, height, width - 2); };
  const Value wide = larger(larger(columns(0), columns(1)), columns(2));
  const auto rows = [&](int i) { return crop(wide, i, 0, height - 2, width - 2); };
  return larger(larger(rows(0), rows(1)), rows(2));
}

/// Convolution without padding, of any odd side: neighbourhoods of 3 x 3 of shifted copies that lie in the
/// channels. Weights beyond the side are zero.
Value wide_convolution(Value x, const TensorFile& file, const Convolution& layer) {
  const std::int64_t blocks = (layer.side + 2) / 3, in = layer.in * blocks * blocks;
  const std::vector<double> oihw =
      file.finite_doubles(std::string(layer.name) + ".weight", {layer.out, layer.in, layer.side, layer.side});
  std::vector<float> weights(static_cast<std::size_t>(9 * in * layer.out));
  for (std::int64_t o = 0; o < layer.out; ++o)
    for (std::int64_t i = 0; i < layer.in; ++i)
      for (std::int64_t u = 0; u < layer.side; ++u)
        for (std::int64_t v = 0; v < layer.side; ++v) {
          const std::int64_t channel = (u / 3 * blocks + v / 3) * layer.in + i, tap = u % 3 * 3 + v % 3;
          weights[(tap * in + channel) * layer.out + o] =
              static_cast<float>(oihw[((o * layer.in + i) * layer.side + u) * layer.side + v]);
        }
  const std::vector<double> bias = file.finite_doubles(std::string(layer.name) + ".bias", {layer.out});
  const std::int64_t height = x.shape()[0] - layer.side + 3, width = x.shape()[1] - layer.side + 3;
  Values shifted;
  for (std::int64_t i = 0; i < blocks; ++i)
    for (std::int64_t j = 0; j < blocks; ++j) shifted.push_back(crop(x, 3 * i, 3 * j, height, width, true));
  Graph& graph = *x.graph;
  return conv2d(shifted.size() == 1 ? x : concat(shifted),
                graph.constant({3, 3, in, layer.out}, std::span<const float>(weights)),
                graph.constant({layer.out}, std::span<const double>(bias)), Padding::none);
}

/// The five layers' activations of an RGB picture in [0, 1].
std::array<Value, 5> activations(Value picture, const TensorFile& file) {
  Graph& graph = *picture.graph;
  std::vector<double> factor(3), offset(3);
  for (int c = 0; c < 3; ++c) {
    factor[c] = 2 / scale[c];
    offset[c] = (-1 - shift[c]) / scale[c];
  }
  const Value scaled = add(multiply(picture, graph.constant({3}, std::span<const double>(factor))),
                           graph.constant({3}, std::span<const double>(offset)));
  const auto convolve = [&](int layer, Value x) {
    return wide_convolution(padded(x, layer < 2 ? 2 : 1, false), file, convolutions[layer]);
  };
  const auto relu = [](Value x) { return activate(x, Activation::relu); };
  std::array<Value, 5> layers;
  layers[0] = relu(blur_and_halve(convolve(0, scaled)));
  layers[1] = relu(convolve(1, blur_and_halve(max_of_nine(layers[0]))));
  layers[2] = relu(convolve(2, blur_and_halve(max_of_nine(layers[1]))));
  layers[3] = relu(convolve(3, layers[2]));
  layers[4] = relu(convolve(4, layers[3]));
  return layers;
}

std::vector<float> unit_values(const cv::Mat& picture) {
  std::vector<float> values;
  for (int y = 0; y < picture.rows; ++y)
    for (int i = 0; i < 3 * picture.cols; ++i)
      values.push_back(static_cast<float>(picture.ptr<std::uint8_t>(y)[i]) / 255.0f);
  return values;
}

}  // namespace

struct StLpips::Network {
  Graph graph;
  std::array<Value, 2> pictures;
  std::array<Value, 5> differences;  ///< [h, w, 1]
  std::unique_ptr<Executor> executor;
};

StLpips::StLpips(Device& device) : StLpips(device, asset_path("stlpips.safetensors")) {}
StLpips::StLpips(Device& device, const std::filesystem::path& file)
    : device_(device), weights_(read_safetensors(file)) {
  for (const Convolution& layer : convolutions)
    weights_.at(std::string(layer.name) + ".weight", {layer.out, layer.in, layer.side, layer.side});
}
StLpips::~StLpips() = default;

StLpips::Network& StLpips::network(cv::Size size) {
  std::unique_ptr<Network>& network = networks_[{size.height, size.width}];
  if (network) return *network;
  network = std::make_unique<Network>();
  Graph& graph = network->graph;
  std::array<std::array<Value, 5>, 2> layers;
  for (int side = 0; side < 2; ++side) {
    network->pictures[side] = graph.input(side == 0 ? "a" : "b", {size.height, size.width, 3});
    layers[side] = activations(network->pictures[side], weights_);
  }
  Values outputs;
  for (int layer = 0; layer < 5; ++layer) {
    const std::int64_t channels = convolutions[layer].out;
    const Value difference = subtract(normalise_rows(layers[0][layer]), normalise_rows(layers[1][layer]));
    const std::vector<double> weights =
        weights_.finite_doubles(fmt::format("linear{}", layer + 1), {channels});
    network->differences[layer] = linear(multiply(difference, difference),
                                         graph.constant({channels, 1}, std::span<const double>(weights)));
    outputs.push_back(network->differences[layer]);
  }
  network->executor = std::make_unique<Executor>(device_, graph, outputs);
  return *network;
}

double StLpips::distance(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  if (a.size() != b.size() || (!mask.empty() && mask.size() != a.size()))
    fail("ST-LPIPS: the pictures have different sizes, {}x{} and {}x{}", a.cols, a.rows, b.cols, b.rows);
  if (std::min(a.cols, a.rows) < smallest_side)
    fail("ST-LPIPS: pictures of {}x{} are too small, {} pixels a side are the least", a.cols, a.rows,
         smallest_side);
  cv::Mat other = b, weight(a.size(), CV_32FC1, cv::Scalar(1));
  if (!mask.empty()) {
    const cv::Mat inside = mask >= 128;
    if (cv::countNonZero(inside) == 0) fail("ST-LPIPS: the mask is empty");
    other = a.clone();
    b.copyTo(other, inside);
    inside.convertTo(weight, CV_32F, 1.0 / 255);
  }
  Network& net = network(a.size());
  net.executor->write(net.pictures[0], unit_values(a));
  net.executor->write(net.pictures[1], unit_values(other));
  net.executor->run();
  double sum = 0;
  for (const Value layer : net.differences) {
    const std::vector<float> values = net.executor->read(layer);
    cv::Mat here;
    cv::resize(weight, here, {static_cast<int>(layer.shape()[1]), static_cast<int>(layer.shape()[0])}, 0, 0,
               cv::INTER_AREA);
    double total = 0, weights = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      total += static_cast<double>(here.ptr<float>()[i]) * values[i];
      weights += here.ptr<float>()[i];
    }
    sum += total / weights;
  }
  return sum;
}

}  // namespace vivant
