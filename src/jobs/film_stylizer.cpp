#include "vivant/jobs/film_stylizer.hpp"

#include "vivant/io/image.hpp"
#include "vivant/model/frame_stylizer.hpp"

namespace vivant {
namespace {

/// Colours as the stylizer sees them: the person alone stands before grey.
std::vector<float> seen_colours(const LayerFrame& frame) {
  std::vector<float> rgb = frame.rgb;
  for (std::size_t i = 0; i < frame.alpha.size(); ++i)
    for (int c = 0; c < 3; ++c) rgb[3 * i + c] += (1 - frame.alpha[i]) * film_grey;
  return rgb;
}

}  // namespace

struct FilmStylizer::State {
  Vgg19 vgg;
  std::vector<std::unique_ptr<FrameStylizer>> styles;
};

void check_can_stylise(const OpenRun& scene) {
  if (!scene.has_features)
    fail("{} has learned no features yet, which styles need: go on with vivant train --resume --run {}",
         scene.folder.path().string(), scene.folder.path().string());
}

FilmStylizer::FilmStylizer(Device& device, const OpenRun& scene, const Film& film, FilmRenderer& renderer,
                           const std::vector<std::filesystem::path>& styles)
    : state_(new State{Vgg19(device), {}}) {
  check_can_stylise(scene);
  std::vector<cv::Mat> paintings;
  for (const std::filesystem::path& style : styles) paintings.push_back(read_image(style));
  const cv::Size size = film_size(film);
  std::vector<LayerFrame> references;
  std::vector<RenderedFrame> views;
  for (const Shot& shot : film.references) {
    references.push_back(renderer.render(shot));
    references.back().rgb = seen_colours(references.back());
  }
  for (const LayerFrame& frame : references) views.push_back({frame.features, frame.rgb});
  for (const cv::Mat& painting : paintings) {
    state_->styles.push_back(
        std::make_unique<FrameStylizer>(device, scene.model->stylizer(), state_->vgg, size.height, size.width,
                                        FrameStylizer::Options{.tokens = scene.config.style.tokens}));
    state_->styles.back()->set_style(painting, scene.model->content_norm().read(), views);
  }
}
FilmStylizer::~FilmStylizer() = default;

LayerFrame FilmStylizer::stylise(const LayerFrame& frame, std::size_t style, double strength) {
  const std::vector<float> rgb = seen_colours(frame);
  LayerFrame painted{frame.width, frame.height, {}, frame.alpha, {}};
  painted.rgb = state_->styles.at(style)->stylise({frame.features, rgb}, strength);
  for (std::size_t i = 0; i < frame.alpha.size(); ++i)
    for (int c = 0; c < 3; ++c) painted.rgb[3 * i + c] *= frame.alpha[i];
  return painted;
}

}  // namespace vivant
