#include "vivant/model/stylizer.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "graph_helpers.hpp"
#include "stylizer_fixture.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/model/detail_match.hpp"
#include "vivant/model/frame_stylizer.hpp"
#include "vivant/model/read_out.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/upsample.hpp"

using namespace vivant;

namespace {

/// The middle of a style picture of the assets, `side` pixels of an enlarged or reduced picture.
cv::Mat picture(const std::string& name, int height, int width) {
  cv::Mat result;
  cv::resize(read_image(asset_path("styles/" + name)), result, {width, height}, 0, 0, cv::INTER_AREA);
  result.convertTo(result, CV_32F, 1.0 / 255);
  return result;
}

double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  REQUIRE(a.size() == b.size());
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs<double>(a[i] - b[i]));
  return largest;
}

double psnr(std::span<const float> a, std::span<const float> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a[i] - b[i], 2);
  return -10 * std::log10(sum / static_cast<double>(a.size()));
}

/// Fits the read-out on four paintings; its mean squared error.
double fit_read_out(StylizerFixture& f) {
  std::vector<float> samples, colours;
  for (const char* name : {"mosaic.jpg", "woodblock.jpg", "cubist.jpg", "pointillism.jpg"}) {
    const cv::Mat shown = picture(name, 128, 128);
    const std::vector<float> seen = f.features(shown);
    cv::Mat small;
    cv::resize(shown, small, {}, 0.25, 0.25, cv::INTER_AREA);
    samples.insert(samples.end(), seen.begin(), seen.end());
    colours.insert(colours.end(), floats_of(small).begin(), floats_of(small).end());
  }
  return start_read_out(f.store, f.stylizer, f.initializer, samples, colours);
}

/// How far, by root mean square, what the attention finds in a random style is from the mean of its values.
double spread_of_found(StylizerOptions options) {
  constexpr std::int64_t side = 8, tokens = side * side, C = Stylizer::features;
  options.deviation_scale = 0;
  StylizerFixture f(options);
  Graph graph;
  const Value features = graph.input("features", {side, side, C}),
              luma = graph.input("luma", {side, side, 1});
  const StyleTokens style = f.stylizer.style_tokens(graph, features, luma);
  const ContentStatistics statistics = f.stylizer.statistics(f.stylizer.content(graph, features), luma);
  const Value found = f.stylizer.attend(graph, features, luma, style, statistics);
  Executor executor(f.device, graph, {found, style.values});
  executor.write(features, f.initializer.normal("features", features.elements(), 1));
  executor.write(luma, f.initializer.normal("luma", luma.elements(), 1));
  executor.run();
  const std::vector<float> got = executor.read(found), values = executor.read(style.values);
  double sum = 0;
  for (std::int64_t c = 0; c < C; ++c) {
    double mean = 0;
    for (std::int64_t t = 0; t < tokens; ++t) mean += values[t * C + c] / static_cast<double>(tokens);
    for (std::int64_t i = 0; i < tokens; ++i) sum += std::pow(got[i * C + c] - mean, 2);
  }
  return std::sqrt(sum / static_cast<double>(tokens * C));
}

/// Stylises a picture in tiles of several sizes, and in one.
void check_tiles(StylizerFixture& f) {
  const cv::Mat shown = picture("cubist.jpg", 64, 80), style = read_image(asset_path("styles/impasto.jpg"));
  const std::vector<float> features = f.features(shown);
  const auto stylise = [&](int tile, int height, int width, double strength) {
    const cv::Mat part = shown(cv::Rect(0, 0, width, height)).clone();
    const RenderedFrame frame{features, floats_of(part)};
    FrameStylizer stylizer(f.device, f.stylizer, f.vgg, height, width, {.tile = tile, .tokens = 64});
    stylizer.set_style(style, stylizer.measure({&frame, 1}), {&frame, 1});
    return stylizer.stylise(frame, strength);
  };
  CHECK(largest_difference(stylise(64, 64, 80, 1), stylise(7, 64, 80, 1)) < 1e-4);
  CHECK(largest_difference(stylise(64, 61, 78, 1), stylise(6, 61, 78, 1)) < 1e-4);

  std::vector<float> plain = f.reconstruct(shown);
  for (float& value : plain) value = std::clamp(value, 0.0f, 1.0f);
  CHECK(largest_difference(stylise(64, 64, 80, 0), plain) < 1e-4);
}

}  // namespace

TEST_CASE("stylizer: the least-squares start decodes a picture that it was not fitted on") {
  for (const char* form : {"guided", "plain"}) {
    CAPTURE(form);
    StylizerFixture f(StylizerOptions::of_form(form));
    CHECK(-10 * std::log10(fit_read_out(f)) > 20);
    const cv::Mat other = picture("impasto.jpg", 96, 96);
    CHECK(psnr(f.reconstruct(other), floats_of(other)) > 17);
  }
}

TEST_CASE(
    "stylizer: the less features and luma weigh in the logits, the nearer to the mean is what is found") {
  const auto spread = [](double feature_weight, double luma_weight) {
    return spread_of_found({.feature_weight = feature_weight, .luma_weight = luma_weight});
  };
  CHECK(spread(0, 0) < tolerance(1e-5));
  CHECK(spread(0, 1) > 0.05);
  CHECK(spread(0, 8) > 1.5 * spread(0, 1));
  CHECK(spread(0.1, 0) > 0.05);
  CHECK(spread(1, 0) > 1.5 * spread(0.1, 0));
}

TEST_CASE("stylizer: tiles do not show, whatever the frame's size; strength 0 is the reconstruction") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  check_tiles(f);
}

TEST_CASE("stylizer: tiles of the mirrored decoder do not show") {
  StylizerFixture f(StylizerOptions::of_form("cosine"));
  fit_read_out(f);
  check_tiles(f);
}

TEST_CASE("stylizer: away from the border the mirrored decoder is VGG-19's encoder backwards") {
  constexpr std::int64_t side = 9, border = 4 * 3, pixels = 4 * side;
  StylizerFixture f(StylizerOptions::plain());
  Graph graph;
  const Value features = graph.input("features", {side, side, Stylizer::features});
  const auto layer = [&](Value x, const std::string& name, Activation activation = Activation::relu) {
    return conv2d(x, f.store.value(graph, "stylizer." + name + ".weight"),
                  f.store.value(graph, "stylizer." + name + ".bias"), Padding::reflect, activation);
  };
  Value x = upsample2x(layer(features, "decoder0"), Upsampling::nearest);
  x = upsample2x(layer(layer(x, "decoder1"), "decoder2"), Upsampling::nearest);
  x = layer(layer(x, "decoder3"), "decoder4", Activation::none);
  const Value mirrored = f.stylizer.decode_image(graph, features, {});
  REQUIRE(mirrored.shape() == Shape{pixels, pixels, 3});
  Executor executor(f.device, graph, {x, mirrored});
  executor.write(features, f.initializer.normal("features", features.elements(), 1));
  executor.run();
  const std::vector<float> expected = executor.read(x), got = executor.read(mirrored);
  double difference = 0, largest = 0;
  for (std::int64_t i = border; i < pixels - border; ++i)
    for (std::int64_t j = 3 * border; j < 3 * (pixels - border); ++j) {
      const float here = expected[i * pixels * 3 + j];
      difference = std::max<double>(difference, std::abs(here - got[i * pixels * 3 + j]));
      largest = std::max<double>(largest, std::abs(here));
    }
  CHECK(largest > 0.01);
  CHECK(difference < tolerance(1e-4) * largest);
}

TEST_CASE("stylizer: mixtures go from one style to the other by their weights") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  const cv::Mat shown = picture("cubist.jpg", 32, 40);
  const std::vector<float> features = f.features(shown);
  const RenderedFrame frame{features, floats_of(shown)};
  const cv::Mat ink = read_image(asset_path("styles/ink_wash.jpg")),
                wood = read_image(asset_path("styles/woodblock.jpg"));
  FrameStylizer stylizer(f.device, f.stylizer, f.vgg, 32, 40, {.tokens = 64});
  const ContentNorm norm = stylizer.measure({&frame, 1});
  const auto mixed = [&](const std::vector<StylePicture>& styles) {
    stylizer.set_style(styles, norm, {&frame, 1});
    return stylizer.stylise(frame, 1);
  };
  const std::vector<float> all_ink = mixed({{ink}}), all_wood = mixed({{wood}});
  CHECK(largest_difference(all_ink, all_wood) > 0.2);
  CHECK(largest_difference(mixed({{ink, 3}, {ink, 1}}), all_ink) < 1e-4);
  CHECK(largest_difference(mixed({{ink, 1e-6}, {wood, 5}}), all_wood) < tolerance(1e-3));
  CHECK(largest_difference(mixed({{ink, 3}, {wood, 1}}), mixed({{wood, 0.25}, {ink, 0.75}})) < 1e-4);
  const std::vector<float> half = mixed({{ink}, {wood}}), most = mixed({{ink, 9}, {wood, 1}});
  CHECK(psnr(most, all_ink) > psnr(half, all_ink) + 5);
  CHECK(psnr(half, all_ink) > psnr(all_wood, all_ink) + 1);
  CHECK_THROWS_AS(mixed({{ink, 0}}), Error);
}

TEST_CASE("stylizer: tokens kept for a style, in tiles, give what one graph with the style in it computes") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  const cv::Mat shown = picture("cubist.jpg", 64, 80);
  cv::Mat style, painting;  // of a size that is kept
  cv::resize(read_image(asset_path("styles/impasto.jpg")), style, {64, 48}, 0, 0, cv::INTER_AREA);
  style.convertTo(painting, CV_32F, 1.0 / 255);
  const std::vector<float> features = f.features(shown);
  const std::span<const float> rgb = floats_of(shown);
  const RenderedFrame frame{features, rgb};
  FrameStylizer quick(f.device, f.stylizer, f.vgg, 64, 80,
                      {.tile = 9, .colour_match = 0, .detail_match = 0, .tokens = 12 * 16});
  quick.set_style(style, quick.measure({&frame, 1}), {&frame, 1});

  Graph graph;
  const Value seen = graph.input("features", {16, 20, 256}), colours = graph.input("rgb", {64, 80, 3}),
              model = graph.input("painting", {48, 64, 3});
  const auto light = [&](Value image) { return f.stylizer.feature_luma(f.stylizer.luma(graph, image)); };
  const StyleTokens tokens =
      f.stylizer.style_tokens(graph, f.vgg.features(model, {"relu3_1"}).at("relu3_1"), light(model));
  const ContentStatistics statistics = f.stylizer.statistics(f.stylizer.content(graph, seen), light(colours));
  const Value image = f.stylizer.stylise(graph, seen, colours, tokens, statistics,
                                         graph.constant({1}, std::vector<double>{1}));
  Executor executor(f.device, graph, {image});
  executor.write(seen, features);
  executor.write(colours, rgb);
  executor.write(model, floats_of(painting));
  executor.run();
  std::vector<float> plain = executor.read(image);
  for (float& value : plain) value = std::clamp(value, 0.0f, 1.0f);
  const std::vector<float> got = quick.stylise(frame, 1);
  CHECK(largest_difference(got, plain) < 1e-4);
  CHECK(largest_difference(got, {rgb.begin(), rgb.end()}) > 0.2);
  // Features that are moved twice as far are where they were at half the strength.
  FrameStylizer further(
      f.device, f.stylizer, f.vgg, 64, 80,
      {.tile = 9, .feature_match = 2, .colour_match = 0, .detail_match = 0, .tokens = 12 * 16});
  further.set_style(style, further.measure({&frame, 1}), {&frame, 1});
  CHECK(largest_difference(further.stylise(frame, 0.5), got) < 1e-5);
  CHECK(largest_difference(further.stylise(frame, 1), got) > 0.05);
}

TEST_CASE("stylizer: the shipped one takes a photograph-like picture to the colours of a painting") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  const cv::Mat shown = picture("pointillism.jpg", 96, 96);
  const std::vector<float> features = f.features(shown);
  const RenderedFrame frame{features, floats_of(shown)};
  CHECK(psnr(f.reconstruct(shown), floats_of(shown)) > 17);
  FrameStylizer stylizer(f.device, f.stylizer, f.vgg, 96, 96, {.tokens = 256});
  ColourStatistics before, after, goal;
  before.add(floats_of(shown));
  const cv::Mat style = picture("woodblock.jpg", 128, 128);
  goal.add(floats_of(style));
  stylizer.set_style(read_image(asset_path("styles/woodblock.jpg")), stylizer.measure({&frame, 1}),
                     {&frame, 1});
  after.add(stylizer.stylise(frame, 1));
  CHECK((after.mean - goal.mean).norm() < 0.6 * (before.mean - goal.mean).norm());
  CHECK(after.covariance.trace() > 0.3 * goal.covariance.trace());  // neither grey nor constant
}

TEST_CASE("stylizer: a file that does not fit is one clear line") {
  StylizerFixture f;
  TensorFile file = save_stylizer(f.store, f.stylizer);
  file.source = "made.safetensors";
  file.tensors.erase("stylizer.psi0.weight");
  CHECK_THROWS_WITH_AS(load_stylizer(f.store, f.stylizer, file), doctest::Contains("stylizer.psi0.weight"),
                       Error);
}

TEST_CASE("stylizer: weights of another form are one clear line") {
  StylizerFixture guided, cosine(StylizerOptions::of_form("cosine")), plain(StylizerOptions::plain());
  TensorFile file = save_stylizer(cosine.store, cosine.stylizer);
  file.source = "made.safetensors";
  load_stylizer(cosine.store, cosine.stylizer, file);
  for (StylizerFixture* other : {&guided, &plain})
    CHECK_THROWS_WITH_AS(load_stylizer(other->store, other->stylizer, file),
                         doctest::Contains("made.safetensors holds no weights of the form"), Error);
  file.metadata.clear();  // as files from before forms had networks of their own
  CHECK_THROWS_WITH_AS(
      load_stylizer(cosine.store, cosine.stylizer, file),
      "made.safetensors holds no weights of the form cosine: `vivant pretrain-stylizer --form "
      "cosine` trains some, for --stylizer",
      Error);
  ParameterStore store;
  CHECK_THROWS_AS(Stylizer(store, cosine.initializer, StylizerOptions{.mirrored = true}), Error);
}

TEST_CASE("stylizer: a frame's detail is raised to the painting's, by the strength of the style") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  cv::Mat shown = picture("ink_wash.jpg", 96, 96);
  cv::GaussianBlur(shown, shown, {}, 3);
  const std::vector<float> features = f.features(shown);
  const RenderedFrame frame{features, floats_of(shown)};
  const auto finest = [&](double amount, double strength) {
    FrameStylizer stylizer(f.device, f.stylizer, f.vgg, 96, 96, {.detail_match = amount, .tokens = 256});
    const ContentNorm norm = stylizer.measure({&frame, 1});
    stylizer.set_style(read_image(asset_path("styles/pointillism.jpg")), norm, {&frame, 1});
    std::vector<float> rgb = stylizer.stylise(frame, strength);
    DetailStrength detail;
    detail.add(cv::Mat(96, 96, CV_32FC3, rgb.data()));
    return std::sqrt(detail.mean_squares[0]);
  };
  const double before = finest(0, 1), after = finest(1, 1);
  CHECK(after > 1.2 * before);
  CHECK(after < 1.1 * largest_detail_gain * before);
  CHECK(finest(0.5, 1) > 1.05 * before);
  CHECK(finest(0.5, 1) < 0.95 * after);
  CHECK(finest(1, 0) == doctest::Approx(finest(0, 0)));
}
