#include "vivant/jobs/film_stylizer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vivant/io/image.hpp"

namespace vivant {
namespace {

constexpr double near_enough = 1.01;  // of the least distance: less is steadier
constexpr double most_scored_pixels = 512 * 288;

/// Colours in 0..1 as a picture, made smaller for the sake of memory and time.
cv::Mat scored_picture(std::span<const float> rgb, cv::Size size) {
  cv::Mat picture;
  cv::Mat(size, CV_32FC3, const_cast<float*>(rgb.data())).convertTo(picture, CV_8U, 255);
  const double factor = std::sqrt(most_scored_pixels / size.area());
  if (factor < 1) cv::resize(picture, picture, {}, factor, factor, cv::INTER_AREA);
  return picture;
}

/// Colours as the stylizer sees them: the person alone stands before grey.
std::vector<float> seen_colours(const LayerFrame& frame) {
  std::vector<float> rgb = frame.rgb;
  for (std::size_t i = 0; i < frame.alpha.size(); ++i)
    for (int c = 0; c < 3; ++c) rgb[3 * i + c] += (1 - frame.alpha[i]) * film_grey;
  return rgb;
}

}  // namespace

double choose_feature_match(FrameStylizer& stylizer, StyleMeter& meter, std::span<const RenderedFrame> views,
                            cv::Size size) {
  std::array<double, film_feature_matches.size()> distances{};
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const std::vector<std::vector<float>> stylised =
        stylizer.set_feature_match(film_feature_matches[i], views);
    for (std::size_t view = 0; view < views.size(); ++view)
      distances[i] +=
          meter.score(scored_picture(stylised[view], size), scored_picture(views[view].rgb, size)).statistics;
  }
  const double good = near_enough * *std::min_element(distances.begin(), distances.end());
  const double* chosen = film_feature_matches.data();
  for (const double* distance = distances.data(); *distance > good; ++distance) ++chosen;
  stylizer.set_feature_match(*chosen, views);
  return *chosen;
}

struct FilmStylizer::State {
  Vgg19 vgg;
  std::vector<Look> looks;
  struct Painter {
    StyleMixture mixture;
    std::unique_ptr<FrameStylizer> stylizer;
  };
  std::vector<Painter> painters;  ///< one for each mixture of the looks

  /// The frame's colours in a mixture of styles; as they are without any.
  std::vector<float> painted(const RenderedFrame& frame, const StyleMixture& mixture,
                             const Look& look) const {
    std::vector<float> rgb(frame.rgb.begin(), frame.rgb.end());
    if (mixture.empty()) return rgb;
    for (const Painter& painter : painters)
      if (painter.mixture == mixture) rgb = painter.stylizer->stylise(frame, look.strength);
    if (look.keep_colour) take_chroma(rgb, frame.rgb);
    return rgb;
  }
  bool has_painter(const StyleMixture& mixture) const {
    return std::any_of(painters.begin(), painters.end(),
                       [&](const Painter& painter) { return painter.mixture == mixture; });
  }
};

std::vector<Layer> layers_to_paint(const LayerFrame& frame, const Look& look) {
  if (!frame.alpha.empty()) return {Layer::person};
  if (!look.layered() || frame.person.empty()) return {Layer::scene};
  return {Layer::scene, Layer::person};
}

void check_can_stylise(const OpenRun& scene) {
  if (!scene.has_features)
    fail("{} has learned no features yet, which styles need: go on with vivant train --resume --run {}",
         scene.folder.path().string(), scene.folder.path().string());
}

FilmStylizer::FilmStylizer(Device& device, const OpenRun& scene, const Film& film, FilmRenderer& renderer,
                           const std::vector<Look>& looks)
    : state_(new State{Vgg19(device), looks, {}}) {
  check_can_stylise(scene);
  const cv::Size size = film_size(film);
  std::vector<LayerFrame> references;
  std::vector<RenderedFrame> views;
  for (const Shot& shot : film.references) {
    references.push_back(renderer.render(shot));
    references.back().rgb = seen_colours(references.back());
  }
  views.reserve(references.size());
  for (const LayerFrame& frame : references) views.push_back({frame.features, frame.rgb});
  for (const Look& look : looks)
    for (const StyleMixture& mixture : {look.person, look.scene}) {
      if (mixture.empty() || state_->has_painter(mixture)) continue;
      std::vector<StylePicture> pictures;
      for (const StyleShare& share : mixture) pictures.push_back({read_image(share.picture), share.weight});
      auto stylizer = std::make_unique<FrameStylizer>(
          device, scene.model->stylizer(), state_->vgg, size.height, size.width,
          FrameStylizer::Options{.colour_match = film_colour_match, .tokens = scene.config.style.tokens});
      stylizer->set_style(pictures, scene.model->content_norm().read(), views);
      StyleMeter meter(device, state_->vgg, pictures.front().picture);
      choose_feature_match(*stylizer, meter, views, size);
      state_->painters.push_back({mixture, std::move(stylizer)});
    }
}
FilmStylizer::~FilmStylizer() = default;

std::vector<float> FilmStylizer::paint(const LayerFrame& frame, std::size_t index, Layer layer) {
  const Look& look = state_->looks.at(index);
  const std::vector<float> rgb = seen_colours(frame);
  return state_->painted({frame.features, rgb}, look.mixture(layer), look);
}

}  // namespace vivant
