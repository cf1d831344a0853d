#include "vivant/model/composite_renderer.hpp"

#include <algorithm>

namespace vivant {
namespace {

HumanRenderer::Options with_scene(HumanRenderer::Options options, const SceneModel& scene) {
  options.scene = &scene;
  return options;
}

}  // namespace

CompositeRenderer::CompositeRenderer(Device& device, const SceneModel& scene, const HumanModel& human,
                                     HumanRenderer::Options options)
    : scene_(device, scene, {.weight_threshold = options.weight_threshold}),
      human_(device, human, with_scene(options, scene)) {}

CompositeRenderer::View CompositeRenderer::render(const Camera& camera, const PersonState& state) {
  View view{scene_.render(camera), cv::Mat::zeros(camera.height, camera.width, CV_32FC1)};
  const PersonView person = human_.render(camera, state);
  const PixelWindow& window = person.window;
  for (int y = 0; y < window.height; ++y) {
    const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(y) * window.width;
    const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(window.y + y) * camera.width + window.x;
    std::copy_n(person.rgb.begin() + 3 * from, 3 * window.width, view.picture.rgb.begin() + 3 * to);
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
