#include "vivant/jobs/film_stylizer.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "vivant/io/image.hpp"
#include "vivant/model/style_score.hpp"

namespace vivant {
namespace {

constexpr double near_enough = 1.01;  // of the least distance: less is steadier
constexpr double most_scored_pixels = 512 * 288;
constexpr int least_scored_side = 32;  // VGG-19 needs it up to relu5_1

/// Colours in 0..1 as a picture, made smaller for the sake of memory and time.
cv::Mat scored_picture(std::span<const float> rgb, cv::Size size) {
  cv::Mat picture;
  cv::Mat(size, CV_32FC3, const_cast<float*>(rgb.data())).convertTo(picture, CV_8U, 255);
  const double factor = std::max(std::sqrt(most_scored_pixels / size.area()),
                                 static_cast<double>(least_scored_side) / std::min(size.width, size.height));
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

double least_good_match(const std::function<double(double)>& distance) {
  std::vector<double> distances;
  for (const double match : film_feature_matches) {
    distances.push_back(distance(match));
    if (distances.size() > 1 && distances.back() > distances.end()[-2]) break;
  }
  const double good = near_enough * *std::min_element(distances.begin(), distances.end());
  const auto chosen = std::find_if(distances.begin(), distances.end(), [&](double d) { return !(d > good); });
  return film_feature_matches[chosen - distances.begin()];
}

double choose_feature_match(Device& device, const Vgg19& vgg, FrameStylizer& stylizer,
                            std::span<const StylePicture> paintings, std::span<const RenderedFrame> views,
                            cv::Size size) {
  double match = film_feature_matches[0];
  if (std::min(size.width, size.height) >= least_scored_side) {
    std::deque<StyleMeter> meters;  // which cannot be moved
    for (const StylePicture& painting : paintings) meters.emplace_back(device, vgg, painting.picture);
    std::vector<RenderedFrame> scored;
    for (std::size_t i = 0; i < views.size(); i += 2) scored.push_back(views[i]);
    match = least_good_match([&](double tried) {
      double distance = 0;
      for (const std::vector<float>& stylised : stylizer.set_feature_match(tried, scored)) {
        const cv::Mat picture = scored_picture(stylised, size);
        for (std::size_t k = 0; k < paintings.size(); ++k)
          distance += paintings[k].weight * meters[k].distance(picture).statistics;
      }
      return distance;
    });
  }
  stylizer.set_feature_match(match, views);
  return match;
}

struct FilmStylizer::State {
  Vgg19 vgg;
  std::vector<Look> looks;
  struct Painter {
    StyleMixture mixture;
    std::unique_ptr<FrameStylizer> stylizer;
    std::optional<Brushwork> brushwork;  ///< when a look has any
  };
  std::vector<Painter> painters;  ///< one for each mixture of the looks

  /// The frame's colours in a mixture of styles; as they are without any.
  std::vector<float> painted(const RenderedFrame& frame, const StyleMixture& mixture,
                             const Look& look) const {
    std::vector<float> rgb(frame.rgb.begin(), frame.rgb.end());
    if (mixture.empty()) return rgb;
    rgb = painter(mixture)->stylizer->stylise(frame, look.strength);
    if (look.keep_colour) take_chroma(rgb, frame.rgb);
    return rgb;
  }
  /// None for a mixture that no look has.
  const Painter* painter(const StyleMixture& mixture) const {
    for (const Painter& painter : painters)
      if (painter.mixture == mixture) return &painter;
    return nullptr;
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
      if (mixture.empty() || state_->painter(mixture)) continue;
      std::vector<StylePicture> pictures;
      for (const StyleShare& share : mixture) pictures.push_back({read_image(share.picture), share.weight});
      auto stylizer = std::make_unique<FrameStylizer>(
          device, scene.model->stylizer(), state_->vgg, size.height, size.width,
          FrameStylizer::Options{.tokens = scene.config.style.tokens});
      stylizer->set_style(pictures, scene.model->content_norm().read());
      choose_feature_match(device, state_->vgg, *stylizer, pictures, views, size);
      State::Painter& painter = state_->painters.emplace_back(mixture, std::move(stylizer), std::nullopt);
      if (std::any_of(looks.begin(), looks.end(), [](const Look& one) { return one.brushwork > 0; }))
        painter.brushwork.emplace(pictures, size);
    }
}
FilmStylizer::~FilmStylizer() = default;

std::vector<float> FilmStylizer::paint(const LayerFrame& frame, std::size_t index, Layer layer) {
  const Look& look = state_->looks.at(index);
  const std::vector<float> rgb = seen_colours(frame);
  return state_->painted({frame.features, rgb}, look.mixture(layer), look);
}

cv::Mat FilmStylizer::with_brushwork(const cv::Mat& picture, const SurfaceTexture& surfaces,
                                     std::size_t index, Layer layer) const {
  const Look& look = state_->looks.at(index);
  const Brushwork& brushwork = *state_->painter(look.mixture(layer))->brushwork;
  const double amount = look.strength * look.brushwork;
  if (!look.keep_colour) return brushwork.laid_onto(picture, surfaces, amount);
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_RGB2GRAY);
  cv::cvtColor(grey, grey, cv::COLOR_GRAY2RGB);
  cv::Mat stroked = brushwork.laid_onto(grey, surfaces, amount, true);
  take_chroma(floats_of(stroked), floats_of(picture));
  return stroked;
}

}  // namespace vivant
