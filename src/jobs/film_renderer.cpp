#include "vivant/jobs/film_renderer.hpp"

#include <algorithm>

namespace vivant {
namespace {

constexpr float grey = 0.75f;  // behind the person alone

/// The window of the person as a whole frame.
LayerFrame whole_frame(const PersonView& view, const Camera& camera) {
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  LayerFrame frame{camera.width, camera.height, std::vector<float>(3 * pixels), std::vector<float>(pixels)};
  for (int y = 0; y < view.window.height; ++y) {
    const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(y) * view.window.width;
    const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(view.window.y + y) * camera.width + view.window.x;
    std::copy_n(view.pixels.begin() + 3 * from, 3 * view.window.width, frame.rgb.begin() + 3 * to);
    std::copy_n(view.alpha.begin() + from, view.window.width, frame.alpha.begin() + to);
  }
  return frame;
}

std::uint8_t byte(float x) { return static_cast<std::uint8_t>(std::clamp(x, 0.0f, 1.0f) * 255.0f + 0.5f); }

}  // namespace

FilmRenderer::FilmRenderer(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
                           const std::string& layers) {
  const HumanModel* human = run.model->human();
  if (layers == "human" && !human)
    throw UsageError(fmt::format("{} has no person", run.folder.path().string()));
  HumanRenderer::Options options = human_renderer_options(run.config, film.known_poses);
  options.units_per_metre = film.units_per_metre;
  if (layers == "human")
    human_.emplace(device, *human, options);
  else if (human && layers == "both")
    both_.emplace(device, scene.model->scene(), *human, options);
  else
    scene_.emplace(device, scene.model->scene(), SceneRenderer::Options{});
}

LayerFrame FilmRenderer::render(const Shot& shot) {
  if (human_) return whole_frame(human_->render(shot.camera, *shot.person), shot.camera);
  RenderedView view = both_ ? both_->render(shot.camera, *shot.person).picture : scene_->render(shot.camera);
  return {view.width, view.height, std::move(view.pixels), {}};
}

cv::Mat to_picture(const LayerFrame& frame) {
  cv::Mat picture(frame.height, frame.width, CV_8UC3);
  for (std::size_t i = 0; i < frame.rgb.size(); ++i)
    picture.data[i] = byte(frame.rgb[i] + (frame.alpha.empty() ? 0 : (1 - frame.alpha[i / 3]) * grey));
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
