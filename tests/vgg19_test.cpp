#include "vivant/nn/vgg19.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "vgg19_helpers.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/ops/reduction.hpp"

using namespace vivant;
namespace fs = std::filesystem;

namespace {

const std::vector<std::string> first_layers = {"relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"};

/// A smooth picture without a pattern that the pixel grid could favour.
std::vector<float> waves(std::int64_t height, std::int64_t width) {
  std::vector<float> image;
  for (std::int64_t y = 0; y < height; ++y)
    for (std::int64_t x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        image.push_back(static_cast<float>(0.5 + 0.4 * std::sin(0.9 * y + 0.37 * (c + 1) * x + c)));
  return image;
}

struct Statistics {
  std::vector<double> mean, std;
};

/// Mean and (population) standard deviation of each channel of [H, W, C].
Statistics statistics(const std::vector<float>& x, std::size_t channels) {
  Statistics s{std::vector<double>(channels), std::vector<double>(channels)};
  const std::size_t count = x.size() / channels;
  const auto pixels = static_cast<double>(count);
  for (std::size_t i = 0; i < x.size(); ++i) s.mean[i % channels] += x[i] / pixels;
  for (std::size_t i = 0; i < x.size(); ++i)
    s.std[i % channels] += (x[i] - s.mean[i % channels]) * (x[i] - s.mean[i % channels]) / pixels;
  for (double& variance : s.std) variance = std::sqrt(variance);
  return s;
}

bool present(const fs::path& path) {
  if (fs::exists(path)) return true;
  MESSAGE("skipped: no " << path);
  return false;
}

}  // namespace

TEST_CASE("VGG-19, plain form: features and their statistics agree with an independent program") {
  const fs::path data = VIVANT_SHARED_DATA, oracle_path = data / "oracles/vgg19_features_fox128.safetensors",
                 weights = data / "weights/vgg19_conv1_1-conv5_1_codebook8.safetensors";
  if (!present(oracle_path) || !present(weights)) return;
  const TensorFile oracle = read_safetensors(oracle_path);
  const HostTensor& pixels = oracle.at("image_rgb", {128, 128, 3});
  const Vgg19 vgg(test_device(), Vgg19::Form::plain, weights);
  Graph graph;
  const Value image = graph.input("image", {128, 128, 3});
  const auto features = vgg.features(image, first_layers);
  Values outputs;
  for (const auto& [name, value] : features) outputs.push_back(value);
  Run run(graph, outputs);
  run.write(image, to_unit(reinterpret_cast<const std::uint8_t*>(pixels.bytes.data()), pixels.bytes.size()));
  for (const auto& [name, value] : features) {
    CAPTURE(name);
    const std::vector<float> got = run.read(value);
    const Statistics s = statistics(got, static_cast<std::size_t>(value.shape().channels()));
    CHECK(relative_error(s.mean, oracle.tensors.at(name + ".mean").as_doubles()) < tolerance(1e-4));
    CHECK(relative_error(s.std, oracle.tensors.at(name + ".std").as_doubles()) < tolerance(1e-4));
    if (oracle.contains(name))
      CHECK(relative_error({got.begin(), got.end()}, channels_last(oracle.at(name))) < tolerance(1e-4));
  }
}

TEST_CASE("VGG-19, normalised form: its mean activations on a photograph are about 1") {
  const fs::path path = fs::path(VIVANT_SHARED_DATA) / "fox/images_4/0001.jpg";
  if (!present(path)) return;
  const cv::Mat photograph = read_image(path);
  const Vgg19 vgg(test_device());
  Graph graph;
  const Value image = graph.input("image", {photograph.rows, photograph.cols, 3});
  const auto features = vgg.features(image, first_layers);
  Values outputs;
  for (const auto& [name, value] : features) outputs.push_back(value);
  Run run(graph, outputs);
  run.write(image, to_unit(photograph.data, photograph.total() * 3));
  for (const auto& [name, value] : features) {
    const std::vector<float> got = run.read(value);
    double mean = 0;
    for (float x : got) mean += x / static_cast<double>(got.size());
    CAPTURE(name);
    CHECK(mean > 0.6);
    CHECK(mean < 1.6);
  }
}

TEST_CASE(
    "VGG-19, normalised form: relu3_1 is that of the published normalised encoder up to channel scale") {
  const fs::path data = VIVANT_SHARED_DATA,
                 path = data / "weights/vgg19_normalised_conv0-conv3_1_fp32.safetensors",
                 oracle_path = data / "oracles/vgg19_features_fox128.safetensors";
  if (!present(path) || !present(oracle_path)) return;
  const TensorFile file = read_safetensors(path);
  Graph graph;
  const Value image = graph.input("image", {128, 128, 3});
  const Value x = published_encoder(file, image).at("relu3_1");
  const Vgg19 vgg(test_device());
  const Value ours = vgg.features(image, {"relu3_1"}).at("relu3_1");
  Run run(graph, {x, ours});
  const HostTensor pixels = read_safetensors(oracle_path).at("image_rgb", {128, 128, 3});
  run.write(image, to_unit(reinterpret_cast<const std::uint8_t*>(pixels.bytes.data()), pixels.bytes.size()));
  const std::vector<float> want = run.read(x), got = run.read(ours);
  REQUIRE(got.size() == want.size());
  std::vector<double> scaled(got.size());
  for (std::size_t c = 0; c < 256; ++c) {
    double both = 0, own = 0;
    for (std::size_t e = c; e < got.size(); e += 256) {
      both += static_cast<double>(got[e]) * want[e];
      own += static_cast<double>(got[e]) * got[e];
    }
    for (std::size_t e = c; e < got.size(); e += 256) scaled[e] = got[e] * both / (own > 0 ? own : 1);
  }
  const double error = relative_error(scaled, {want.begin(), want.end()});
  MESSAGE("relative difference " << error);
  CHECK(error < 0.01);  // what the codebook costs
}

TEST_CASE("VGG-19: away from the border both forms differ by the activation means alone") {
  constexpr std::int64_t side = 32, border = 6, channels = 128;
  const TensorFile file = read_safetensors(asset_path("vgg19.safetensors"));
  const std::vector<double> mean = file.finite_doubles("conv2_1.activation_mean", {channels});
  const Vgg19 plain(test_device(), Vgg19::Form::plain), normalised(test_device());
  Graph graph;
  const Value image = graph.input("image", {side, side, 3});
  const Value a = plain.features(image, {"relu2_1"}).at("relu2_1"),
              b = normalised.features(image, {"relu2_1"}).at("relu2_1");
  Run run(graph, {a, b});
  run.write(image, waves(side, side));
  const std::vector<float> from_plain = run.read(a), got = run.read(b);
  std::vector<double> want, inside;
  for (std::int64_t y = border; y < side / 2 - border; ++y)
    for (std::int64_t x = border; x < side / 2 - border; ++x)
      for (std::int64_t c = 0; c < channels; ++c) {
        const std::size_t e = (y * side / 2 + x) * channels + c;
        want.push_back(from_plain[e] / mean[c]);
        inside.push_back(got[e]);
      }
  CHECK(relative_error(inside, want) < 1e-4);
}

TEST_CASE("VGG-19: the gradient reaches the image") {
  constexpr std::int64_t side = 24;
  const Vgg19 vgg(test_device());
  Graph graph;
  const Value image = graph.input("image", {side, side, 3});
  const Value loss = mean(vgg.features(image, {"relu3_1"}).at("relu3_1"));
  const Value grad = differentiate(graph, loss, {image}).front();
  Run run(graph, {loss, grad});
  const std::vector<float> at = waves(side, side);
  run.write(image, at);
  const std::vector<float> gradient = run.read(grad);
  // Along the gradient itself the loss changes fastest, so rounding matters least.
  double square = 0;
  for (float g : gradient) square += static_cast<double>(g) * g;
  REQUIRE(square > 0);
  const double step = 1e-2 / std::sqrt(square);
  const auto loss_at = [&](double distance) {
    std::vector<float> moved = at;
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += static_cast<float>(distance * gradient[i]);
    run.write(image, moved);
    return static_cast<double>(run.read(loss)[0]);
  };
  CHECK((loss_at(step) - loss_at(-step)) / (2 * step) ==
        doctest::Approx(square).epsilon(tolerance(0.01, 0.1)));
}

TEST_CASE("VGG-19: weights that do not fit, and unknown layers, are errors") {
  const TemporaryFolder folder;
  TensorFile file = read_safetensors(asset_path("vgg19.safetensors"));
  file.tensors.at("conv2_1.codebook") = HostTensor({2}, std::vector<float>{1, 2});
  write_safetensors(folder / "small.safetensors", file);
  CHECK_THROWS_WITH_AS(Vgg19(test_device(), Vgg19::Form::plain, folder / "small.safetensors"),
                       doctest::Contains("conv2_1.codebook"), Error);
  file = read_safetensors(asset_path("vgg19.safetensors"));
  file.tensors.at("conv1_2.activation_mean") = HostTensor({64}, std::vector<float>(64, 0.0f));
  write_safetensors(folder / "zero.safetensors", file);
  CHECK_THROWS_WITH_AS(Vgg19(test_device(), Vgg19::Form::normalised, folder / "zero.safetensors"),
                       doctest::Contains("conv1_2.activation_mean"), Error);
  const Vgg19 vgg(test_device());
  Graph graph;
  CHECK_THROWS_WITH_AS(vgg.features(graph.input("image", {16, 16, 3}), {"relu6_1"}),
                       doctest::Contains("relu6_1"), Error);
}
