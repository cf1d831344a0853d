// How a film is made: plan_film (film.hpp) says which shots; FilmRenderer renders one shot to a LayerFrame,
// floats that are not yet a picture; to_picture rounds them. A stylised picture is made in between: the
// frame's colours and features are a RenderedFrame (frame_stylizer.hpp), which one FrameStylizer a style
// turns into other colours, so that a shot is rendered once for all styles.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "vivant/jobs/film.hpp"
#include "vivant/model/composite_renderer.hpp"

namespace vivant {

/// A rendered shot.
struct LayerFrame {
  int width = 0, height = 0;
  std::vector<float> rgb;    ///< [H, W, 3] not clamped; the person alone is premultiplied with alpha
  std::vector<float> alpha;  ///< [H, W], empty unless the person is alone
};

/// Renders the layers that are asked for: "both", "scene" or "human". A run without a person shows its scene.
class FilmRenderer {
 public:
  /// Renders shots of `film`, which was planned for the person of `run` in the scene of `scene`. Device and
  /// runs must outlive it. Throws UsageError for the person of a run without one.
  FilmRenderer(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
               const std::string& layers);
  LayerFrame render(const Shot& shot);

 private:
  std::optional<SceneRenderer> scene_;
  std::optional<HumanRenderer> human_;
  std::optional<CompositeRenderer> both_;
};

/// CV_8UC3 RGB; the person alone is put over grey.
cv::Mat to_picture(const LayerFrame& frame);
/// The same, but the person alone as CV_8UC4 RGBA, not premultiplied.
cv::Mat to_picture_with_alpha(const LayerFrame& frame);

}  // namespace vivant
