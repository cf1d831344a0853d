#include "vivant/jobs/film_renderer.hpp"

#include <algorithm>
#include <cmath>

#include "vivant/model/composite_renderer.hpp"
#include "vivant/model/frame_stylizer.hpp"

namespace vivant {

/// Renders one output of the layers.
class FilmRenderer::Layers {
 public:
  Layers(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
         const std::string& layers, Output output) {
    const HumanModel* human = run.model->human();
    if (layers == "human" && !human)
      throw UsageError(fmt::format("{} has no person", run.folder.path().string()));
    HumanRenderer::Options options = human_renderer_options(run.config, film.known_poses);
    options.units_per_metre = film.units_per_metre;
    options.light = film.light;
    options.output = output;
    if (layers == "human")
      human_.emplace(device, *human, options);
    else if (human && layers == "both")
      both_.emplace(device, scene.model->scene(), *human, options);
    else
      scene_.emplace(device, scene.model->scene(), SceneRenderer::Options{.output = output});
  }

  /// Pixels [H, W, C], the alpha of the person alone, and the person's share of each pixel before a scene.
  struct Pixels {
    std::vector<float> values, alpha, person, depth;
  };
  Pixels render(const Camera& camera, const std::optional<PersonState>& person) {
    if (human_) return whole_frame(human_->render(camera, *person), camera);
    if (!both_) {
      RenderedView picture = scene_->render(camera);
      return {std::move(picture.pixels), {}, {}, surface_depth(picture)};
    }
    CompositeRenderer::View view = both_->render(camera, *person);
    return {std::move(view.picture.pixels),
            {},
            {view.person.begin<float>(), view.person.end<float>()},
            surface_depth(view.picture)};
  }

 private:
  /// The depth of what is seen, where most of the light comes from something.
  static std::vector<float> surface_depth(const RenderedView& view) {
    std::vector<float> depth(view.depth.size());
    for (std::size_t i = 0; i < depth.size(); ++i)
      if (view.alpha[i] > 0.5f) depth[i] = view.depth[i];
    return depth;
  }

  /// The window of the person as a whole frame.
  static Pixels whole_frame(const PersonView& view, const Camera& camera) {
    const std::size_t channels = view.window.empty() ? 0 : view.pixels.size() / view.alpha.size();
    const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
    Pixels whole{
        std::vector<float>(channels * pixels), std::vector<float>(pixels), {}, std::vector<float>(pixels)};
    for (int y = 0; y < view.window.height; ++y) {
      const std::size_t from = static_cast<std::size_t>(y) * view.window.width;
      const std::size_t to = static_cast<std::size_t>(view.window.y + y) * camera.width + view.window.x;
      std::copy_n(&view.pixels[channels * from], channels * view.window.width, &whole.values[channels * to]);
      std::copy_n(&view.alpha[from], view.window.width, &whole.alpha[to]);
      for (int x = 0; x < view.window.width; ++x)
        if (view.alpha[from + x] > 0.5f) whole.depth[to + x] = view.depth[from + x];
    }
    return whole;
  }

  std::optional<SceneRenderer> scene_;
  std::optional<HumanRenderer> human_;
  std::optional<CompositeRenderer> both_;
};

FilmRenderer::FilmRenderer(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
                           const std::string& layers, bool features)
    : colours_(std::make_unique<Layers>(device, run, scene, film, layers, Output::colour)) {
  if (features) features_ = std::make_unique<Layers>(device, run, scene, film, layers, Output::feature);
}
FilmRenderer::~FilmRenderer() = default;

namespace {

/// The camera whose rays go through places beside the pixels' centres, `x` and `y` pixels away.
Camera beside(Camera camera, double x, double y) {
  camera.cx -= x;
  camera.cy -= y;
  return camera;
}

}  // namespace

// A feature stands for 4 x 4 pixels: with a single ray it jumps from frame to frame, and the attention makes
// strokes of that (docs/evaluation.md).
std::vector<float> FilmRenderer::mean_features(Layers& layers, const Shot& shot) {
  const Camera camera = feature_camera(shot.camera);
  std::vector<float> mean(Stylizer::features * static_cast<std::size_t>(camera.width) * camera.height);
  const float share = 1.0f / static_cast<float>(feature_rays * feature_rays);
  for (int i = 0; i < feature_rays; ++i)
    for (int j = 0; j < feature_rays; ++j) {
      const Camera here = beside(camera, (j + 0.5) / feature_rays - 0.5, (i + 0.5) / feature_rays - 0.5);
      const std::vector<float> features = layers.render(here, shot.person).values;
      for (std::size_t k = 0; k < features.size(); ++k) mean[k] += share * features[k];
    }
  return mean;
}

LayerFrame FilmRenderer::render(const Shot& shot) {
  Layers::Pixels colours = colours_->render(shot.camera, shot.person);
  const std::size_t pixels = static_cast<std::size_t>(shot.camera.width) * shot.camera.height;
  colours.values.resize(3 * pixels);  // a person outside of the picture has none
  LayerFrame frame{shot.camera.width,
                   shot.camera.height,
                   std::move(colours.values),
                   std::move(colours.alpha),
                   std::move(colours.person),
                   std::move(colours.depth),
                   {}};
  if (features_) {
    frame.features = mean_features(*features_, shot);
  }
  return frame;
}

namespace {

std::uint8_t byte(float x) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(x, 0.0f, 1.0f) * 255.0f));
}

}  // namespace

cv::Mat to_picture(const LayerFrame& frame) {
  cv::Mat picture(frame.height, frame.width, CV_8UC3);
  for (std::size_t i = 0; i < frame.rgb.size(); ++i)
    picture.data[i] = byte(frame.rgb[i] + (frame.alpha.empty() ? 0 : (1 - frame.alpha[i / 3]) * film_grey));
  return picture;
}

cv::Mat to_picture_with_alpha(const LayerFrame& frame) {
  if (frame.alpha.empty()) return to_picture(frame);
  cv::Mat picture(frame.height, frame.width, CV_8UC4, cv::Scalar::all(0));
  for (std::size_t i = 0; i < frame.alpha.size(); ++i) {
    if (!(frame.alpha[i] > 0)) continue;
    for (int c = 0; c < 3; ++c) picture.data[4 * i + c] = byte(frame.rgb[3 * i + c] / frame.alpha[i]);
    picture.data[4 * i + 3] = byte(frame.alpha[i]);
  }
  return picture;
}

}  // namespace vivant
