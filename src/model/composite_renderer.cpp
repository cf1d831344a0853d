#include "vivant/model/composite_renderer.hpp"

#include <algorithm>

namespace vivant {
namespace {

HumanRenderer::Options with_scene(HumanRenderer::Options options, const SceneModel& scene) {
  options.scene = &scene;
  return options;
}

/// Pixels with more channels, zero in the new ones.
std::vector<float> widened(const std::vector<float>& pixels, std::size_t count, std::size_t channels) {
  const std::size_t before = pixels.size() / count;
  std::vector<float> result(count * channels);
  for (std::size_t i = 0; i < count; ++i)
    std::copy_n(pixels.begin() + i * before, before, result.begin() + i * channels);
  return result;
}

}  // namespace

CompositeRenderer::CompositeRenderer(Device& device, const SceneModel& scene, const HumanModel& human,
                                     HumanRenderer::Options options)
    : scene_(device, scene, {.weight_threshold = options.weight_threshold, .output = options.output}),
      human_(device, human, with_scene(options, scene)),
      hidden_(options.output == Output::hidden) {}

CompositeRenderer::View CompositeRenderer::render(const Camera& camera, const PersonState& state) {
  View view{scene_.render(camera), cv::Mat::zeros(camera.height, camera.width, CV_32FC1)};
  const PersonView person = human_.render(camera, state);
  const PixelWindow& window = person.window;
  const std::size_t area = static_cast<std::size_t>(camera.width) * camera.height;
  const std::size_t channels = hidden_ ? 2 * (Field::hidden_width + 1) : view.picture.pixels.size() / area;
  if (hidden_) view.picture.pixels = widened(view.picture.pixels, area, channels);
  for (int y = 0; y < window.height; ++y) {
    const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(y) * window.width;
    const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(window.y + y) * camera.width + window.x;
    std::copy_n(person.pixels.begin() + channels * from, channels * window.width,
                view.picture.pixels.begin() + channels * to);
    std::copy_n(person.alpha.begin() + from, window.width, view.person.ptr<float>(window.y + y) + window.x);
    std::copy_n(person.opacity.begin() + from, window.width, view.picture.alpha.begin() + to);
    std::copy_n(person.depth.begin() + from, window.width, view.picture.depth.begin() + to);
  }
  return view;
}

std::vector<cv::Mat> render_backgrounds(Device& device, const SceneModel& scene, const Capture& capture,
                                        const std::vector<int>& frames) {
  SceneRenderer renderer(device, scene, {});
  std::vector<cv::Mat> pictures;
  for (const int frame : frames) pictures.push_back(renderer.render(capture.frames[frame].camera).rgb8());
  return pictures;
}

}  // namespace vivant
