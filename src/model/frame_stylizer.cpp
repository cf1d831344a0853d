#include "vivant/model/frame_stylizer.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "model/frame_tiles.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/io/image.hpp"
#include "vivant/model/detail_match.hpp"

namespace vivant {
namespace {

constexpr std::int64_t C = Stylizer::features;
constexpr std::int64_t most_samples = 16384;  // features of a frame that its statistics are taken from
constexpr std::int64_t detail_halo = Stylizer::detail_halo, detail_channels = Stylizer::detail_channels;

/// Mean and deviation by channel of all frames together, from those of each.
struct HostStatistics {
  std::vector<float> mean, deviation;
};
HostStatistics pooled(const std::vector<HostStatistics>& frames) {
  HostStatistics all = frames.front();
  for (std::size_t c = 0; c < all.mean.size(); ++c) {
    double sum = 0, square = 0;
    for (const HostStatistics& frame : frames) {
      sum += frame.mean[c];
      square += std::pow(frame.mean[c], 2) + std::pow(frame.deviation[c], 2);
    }
    const double mean = sum / static_cast<double>(frames.size());
    all.mean[c] = static_cast<float>(mean);
    all.deviation[c] =
        static_cast<float>(std::sqrt(square / static_cast<double>(frames.size()) - mean * mean));
  }
  return all;
}

/// A style picture at the size that gives at most `tokens` tokens; sides are multiples of 16.
cv::Mat style_picture(const cv::Mat& rgb8, std::int64_t tokens) {
  const double factor =
      std::sqrt(static_cast<double>(tokens) * 16 / (static_cast<double>(rgb8.rows) * rgb8.cols));
  const auto side = [&](int pixels) { return std::max(32, static_cast<int>(pixels * factor) / 16 * 16); };
  cv::Mat picture;
  rgb8.convertTo(picture, CV_32F, 1.0 / 255);
  cv::resize(picture, picture, {side(rgb8.cols), side(rgb8.rows)}, 0, 0,
             factor < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  return cv::min(cv::max(picture, 0.0), 1.0);
}

/// A style's tokens on the host.
struct HostTokens {
  struct Tensor {
    Shape shape;
    std::vector<float> values;
  };
  Tensor keys, values;
  std::optional<Tensor> bias;
};

/// What colours and detail are matched with.
struct Painting {
  double share;
  ColourStatistics colours;
  DetailStrength detail;
};

}  // namespace

std::vector<double> shares_of(std::span<const StylePicture> styles) {
  double sum = 0;
  std::vector<double> shares;
  for (const StylePicture& style : styles) {
    if (!(style.weight > 0)) fail("the weight of a style must be above 0, not {}", style.weight);
    sum += style.weight;
  }
  for (const StylePicture& style : styles) shares.push_back(style.weight / sum);
  return shares;
}

Camera feature_camera(const Camera& camera) {
  constexpr int scale = Stylizer::scale;
  Camera result = camera;
  result.width = (camera.width + scale - 1) / scale;
  result.height = (camera.height + scale - 1) / scale;
  for (double* number : {&result.fx, &result.fy, &result.cx, &result.cy}) *number /= scale;
  return result;
}

struct FrameStylizer::State {
  State(Device& device, const Stylizer& stylizer, const Vgg19& vgg, int height, int width,
        const Options& options);

  void set_style(std::span<const StylePicture> styles, const ContentNorm& norm);
  void set_norm(const ContentNorm& norm);
  /// Returns the frames in the style, colours and detail matched.
  std::vector<std::vector<float>> match(std::span<const RenderedFrame> frames);
  HostTokens tokens_of(const cv::Mat& rgb8);
  ContentNorm measure(std::span<const RenderedFrame> frames);
  /// Luma at a quarter and detail of a frame.
  void look_at(const RenderedFrame& frame);
  std::vector<float> stylise(const RenderedFrame& frame, double strength);
  /// Colours of a frame as a picture that shares them.
  cv::Mat picture_of(std::vector<float>& rgb) const;

  Device& device;
  const Stylizer& stylizer;
  const Vgg19& vgg;
  Options options;
  const std::int64_t height, width;            ///< of the frame
  const std::int64_t rows, columns;            ///< of its features
  const std::int64_t tile_rows, tile_columns;  ///< of a tile, without its halo
  const std::int64_t halo;                     ///< features around a tile
  const std::int64_t samples;                  ///< features of a frame from which statistics are taken
  std::vector<Painting> paintings;
  ColourTransform colours;
  DetailTransform details;

  // From the colours of a whole frame: luma and detail.
  Graph frame_graph;
  Value rgb, small_luma, detail;
  TileImage luma_now, detail_now;
  // Statistics of samples of a frame.
  Graph statistics_graph;
  Value sample_features, sample_luma;
  ContentStatistics sample_statistics;
  // One tile.
  std::unique_ptr<Graph> tile_graph;
  Value features, tile_luma, tile_detail, strength_value, image;
  ContentStatistics statistics;
  std::unique_ptr<Executor> frame_executor, statistics_executor, tile_executor;
};

FrameStylizer::State::State(Device& device, const Stylizer& stylizer, const Vgg19& vgg, int height, int width,
                            const Options& options)
    : device(device),
      stylizer(stylizer),
      vgg(vgg),
      options(options),
      height(height),
      width(width),
      rows((height + 3) / Stylizer::scale),
      columns((width + 3) / Stylizer::scale),
      tile_rows(std::min<std::int64_t>(rows, options.tile)),
      tile_columns(std::min<std::int64_t>(columns, options.tile)),
      halo(stylizer.feature_halo()),
      samples(std::min(rows * columns, most_samples)) {
  rgb = frame_graph.input("rgb", {rows * Stylizer::scale, columns * Stylizer::scale, 3});
  const Value luma = stylizer.luma(frame_graph, rgb);
  small_luma = stylizer.feature_luma(luma);
  detail = stylizer.detail(luma);
  frame_executor = std::make_unique<Executor>(device, frame_graph, Values{small_luma, detail});

  sample_features = statistics_graph.input("features", {samples, C});
  sample_luma = statistics_graph.input("luma", {samples, 1});
  sample_statistics = stylizer.statistics(stylizer.content(statistics_graph, sample_features), sample_luma);
  statistics_executor =
      std::make_unique<Executor>(device, statistics_graph,
                                 Values{sample_statistics.features.mean, sample_statistics.features.deviation,
                                        sample_statistics.luma.mean, sample_statistics.luma.deviation});
}

HostTokens FrameStylizer::State::tokens_of(const cv::Mat& rgb8) {
  Graph graph;
  const cv::Mat small = style_picture(rgb8, options.tokens);
  const Value picture = graph.input("painting", {small.rows, small.cols, 3});
  const Value light = stylizer.feature_luma(stylizer.luma(graph, picture));
  const StyleTokens tokens =
      stylizer.style_tokens(graph, vgg.features(picture, {"relu3_1"}).at("relu3_1"), light);
  Values outputs = {tokens.keys, tokens.values};
  if (tokens.bias) outputs.push_back(tokens.bias);
  Executor executor(device, graph, outputs);
  executor.write(picture, floats_of(small));
  executor.run();
  const auto read = [&](Value value) { return HostTokens::Tensor{value.shape(), executor.read(value)}; };
  HostTokens result{read(tokens.keys), read(tokens.values), {}};
  if (tokens.bias) result.bias = read(tokens.bias);
  return result;
}

void FrameStylizer::State::set_style(std::span<const StylePicture> styles, const ContentNorm& norm) {
  const std::vector<double> shares = shares_of(styles);
  tile_executor.reset();
  colours = {};
  details = {};
  tile_graph = std::make_unique<Graph>();
  Graph& graph = *tile_graph;
  features = graph.input("features", {tile_rows + 2 * halo, tile_columns + 2 * halo, C});
  tile_luma = graph.input("luma", {tile_rows + 2 * halo, tile_columns + 2 * halo, 1});
  tile_detail = graph.input("detail", {Stylizer::scale * tile_rows + 2 * detail_halo,
                                       Stylizer::scale * tile_columns + 2 * detail_halo, detail_channels});
  strength_value = graph.scalar("strength");
  statistics = {{graph.input("mean", {C}), graph.input("deviation", {C})},
                {graph.input("luma mean", {1}), graph.input("luma deviation", {1})}};
  const Value content = stylizer.content(graph, features);

  std::vector<std::pair<Value, std::vector<float>>> numbers;  // of the styles
  const auto copied = [&](const char* name, HostTokens::Tensor tensor) {
    numbers.emplace_back(graph.input(name, tensor.shape), std::move(tensor.values));
    return numbers.back().first;
  };
  // S * norm(c) + M is linear in M and S: what the styles give is mixed instead of what they are made of.
  Value stylised;
  paintings.clear();
  for (std::size_t i = 0; i < styles.size(); ++i) {
    const cv::Mat picture = style_picture(styles[i].picture, options.tokens);
    Painting& painting = paintings.emplace_back(Painting{shares[i], {}, {}});
    painting.colours.add(floats_of(picture));
    painting.detail.add(picture);
    HostTokens tokens = tokens_of(styles[i].picture);
    const StyleTokens here = {copied("keys", std::move(tokens.keys)),
                              tokens.bias ? copied("bias", std::move(*tokens.bias)) : Value{},
                              copied("values", std::move(tokens.values))};
    Value one = stylizer.attend(graph, content, tile_luma, here, statistics);
    if (styles.size() > 1) one = affine(one, shares[i]);
    stylised = stylised ? add(stylised, one) : one;
  }
  image = stylizer.decode(graph, blend(content, stylised, strength_value),
                          stylizer.options().detail ? tile_detail : Value{});
  tile_executor = std::make_unique<Executor>(device, graph, Values{image});
  for (const auto& [value, here] : numbers) tile_executor->write(value, here);
  set_norm(norm);
}

void FrameStylizer::State::set_norm(const ContentNorm& norm) {
  const Values targets = statistics.values();
  const std::vector<float>* measured[] = {&norm.feature_mean, &norm.feature_deviation, &norm.luma_mean,
                                          &norm.luma_deviation};
  for (std::size_t i = 0; i < targets.size(); ++i) tile_executor->write(targets[i], *measured[i]);
}

cv::Mat FrameStylizer::State::picture_of(std::vector<float>& rgb) const {
  return {static_cast<int>(height), static_cast<int>(width), CV_32FC3, rgb.data()};
}

std::vector<std::vector<float>> FrameStylizer::State::match(std::span<const RenderedFrame> frames) {
  std::vector<std::vector<float>> stylised;
  ColourStatistics rendered;
  for (const RenderedFrame& frame : frames) {
    stylised.push_back(stylise(frame, 1));
    rendered.add(stylised.back());
  }
  colours = {Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero()};
  DetailStrength before, aim;
  for (const Painting& painting : paintings) {
    const ColourTransform own = match_colours(rendered, painting.colours).blended(options.colour_match);
    colours.matrix += painting.share * own.matrix;
    colours.offset += painting.share * own.offset;
    aim.mix(painting.detail, painting.share);
  }
  for (std::vector<float>& frame : stylised) {
    colours.apply(frame);
    before.add(picture_of(frame));
  }
  details = match_detail(before, aim).blended(options.detail_match);
  for (std::vector<float>& frame : stylised) {
    cv::Mat picture = picture_of(frame);
    details.apply(picture);
  }
  return stylised;
}

void FrameStylizer::State::look_at(const RenderedFrame& frame) {
  if (static_cast<std::int64_t>(frame.features.size()) != rows * columns * C ||
      static_cast<std::int64_t>(frame.rgb.size()) != height * width * 3)
    fail("a frame of {} x {} needs features [{}, {}, {}] and colours [{}, {}, 3]; it has {} and {} numbers",
         width, height, rows, columns, C, height, width, frame.features.size(), frame.rgb.size());
  const TileImage padded = part(frame.rgb, height, width, 3,
                                tile_rectangle(0, 0, rows * Stylizer::scale, columns * Stylizer::scale));
  frame_executor->write(rgb, padded.values);
  frame_executor->run();
  luma_now = {rows, columns, 1, frame_executor->read(small_luma)};
  detail_now = {rows * Stylizer::scale, columns * Stylizer::scale, detail_channels,
                frame_executor->read(detail)};
}

ContentNorm FrameStylizer::State::measure(std::span<const RenderedFrame> frames) {
  std::vector<HostStatistics> of_features, of_luma;
  for (const RenderedFrame& frame : frames) {
    look_at(frame);
    std::vector<float> chosen_features, chosen_luma;
    for (std::int64_t i = 0; i < samples; ++i) {
      const std::int64_t place = i * rows * columns / samples;
      const auto pixel = frame.features.subspan(place * C, C);
      chosen_features.insert(chosen_features.end(), pixel.begin(), pixel.end());
      chosen_luma.push_back(luma_now.values[place]);
    }
    Executor& executor = *statistics_executor;
    executor.write(sample_features, chosen_features);
    executor.write(sample_luma, chosen_luma);
    executor.run();
    const auto read = [&](const ChannelStatistics& s) {
      return HostStatistics{executor.read(s.mean), executor.read(s.deviation)};
    };
    of_features.push_back(read(sample_statistics.features));
    of_luma.push_back(read(sample_statistics.luma));
  }
  const HostStatistics feature = pooled(of_features), luma = pooled(of_luma);
  return {feature.mean, feature.deviation, luma.mean, luma.deviation};
}

std::vector<float> FrameStylizer::State::stylise(const RenderedFrame& frame, double strength) {
  look_at(frame);
  tile_executor->set(strength_value, options.feature_match * strength);
  std::vector<float> result(height * width * 3);
  for (const std::int64_t top : tile_starts(rows, tile_rows))
    for (const std::int64_t left : tile_starts(columns, tile_columns)) {
      const cv::Rect around =
          tile_rectangle(top - halo, left - halo, tile_rows + 2 * halo, tile_columns + 2 * halo);
      const std::int64_t first_row = top * Stylizer::scale, first_column = left * Stylizer::scale,
                         tile_height = tile_rows * Stylizer::scale,
                         tile_width = tile_columns * Stylizer::scale;
      tile_executor->write(features, part(frame.features, rows, columns, C, around).values);
      tile_executor->write(tile_luma, part(luma_now, around).values);
      tile_executor->write(
          tile_detail,
          part(detail_now, tile_rectangle(first_row - detail_halo, first_column - detail_halo,
                                          tile_height + 2 * detail_halo, tile_width + 2 * detail_halo))
              .values);
      tile_executor->run();
      const std::vector<float> colours_here = tile_executor->read(image);
      const std::int64_t kept = std::min(tile_width, width - first_column);
      for (std::int64_t i = 0; i < std::min(tile_height, height - first_row); ++i)
        std::copy_n(&colours_here[i * tile_width * 3], kept * 3,
                    &result[((first_row + i) * width + first_column) * 3]);
    }
  return result;
}

FrameStylizer::FrameStylizer(Device& device, const Stylizer& stylizer, const Vgg19& vgg, int height,
                             int width, const Options& options)
    : state_(std::make_unique<State>(device, stylizer, vgg, height, width, options)) {}
FrameStylizer::~FrameStylizer() = default;

ContentNorm FrameStylizer::measure(std::span<const RenderedFrame> frames) {
  if (frames.empty()) fail("the statistics of frames need at least one frame");
  return state_->measure(frames);
}

void FrameStylizer::set_style(std::span<const StylePicture> styles, const ContentNorm& norm) {
  if (styles.empty()) fail("a style needs at least one picture");
  state_->set_style(styles, norm);
}

void FrameStylizer::set_style(std::span<const StylePicture> styles, const ContentNorm& norm,
                              std::span<const RenderedFrame> frames) {
  if (frames.empty()) fail("a style needs at least one frame that it will be used on");
  set_style(styles, norm);
  state_->match(frames);
}

std::vector<std::vector<float>> FrameStylizer::set_feature_match(double match,
                                                                 std::span<const RenderedFrame> frames) {
  if (!state_->tile_executor) fail("a match is set before a style was");
  if (frames.empty()) fail("a match needs at least one frame that it will be used on");
  state_->options.feature_match = match;
  return state_->match(frames);
}

void FrameStylizer::set_style(const cv::Mat& picture, const ContentNorm& norm,
                              std::span<const RenderedFrame> frames) {
  const StylePicture style{picture};
  set_style({&style, 1}, norm, frames);
}

void FrameStylizer::set_norm(const ContentNorm& norm) {
  if (!state_->tile_executor) fail("statistics are set before a style was");
  state_->set_norm(norm);
}

std::vector<float> FrameStylizer::stylise(const RenderedFrame& frame, double strength) {
  if (!state_->tile_executor) fail("a frame is stylised before a style was set");
  std::vector<float> result = state_->stylise(frame, strength);
  state_->colours.blended(strength).apply(result);
  cv::Mat picture = state_->picture_of(result);
  state_->details.blended(strength).apply(picture);
  return result;
}

}  // namespace vivant
