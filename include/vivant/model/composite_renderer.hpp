#pragma once
#include "vivant/model/human_renderer.hpp"
#include "vivant/model/view_renderer.hpp"

namespace vivant {

/// Renders person and scene in one picture: the scene everywhere, both merged by depth where the person is
/// near.
class CompositeRenderer {
 public:
  struct View {
    RenderedView picture;
    cv::Mat person;  ///< CV_32FC1, alpha of the person
  };
  /// `options.scene` is set by this class. With Output::hidden every pixel has 258 channels: the scene's,
  /// then the person's.
  CompositeRenderer(Device& device, const SceneModel& scene, const HumanModel& human,
                    HumanRenderer::Options options);
  View render(const Camera& camera, const PersonState& state);

 private:
  SceneRenderer scene_;
  HumanRenderer human_;
  bool hidden_;
};

/// What stands behind the person in the given frames, CV_8UC3 RGB.
std::vector<cv::Mat> render_backgrounds(Device& device, const SceneModel& scene, const Capture& capture,
                                        const std::vector<int>& frames);

}  // namespace vivant
