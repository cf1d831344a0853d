// How a film is made: plan_film (film.hpp) says which shots; FilmRenderer renders one shot to a LayerFrame,
// floats that are not yet a picture; FilmStylizer (film_stylizer.hpp) gives the frame other colours, once for
// every style; FilmFrames (film_frames.hpp) does both and takes the mean over neighbouring frames; to_picture
// rounds them.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "vivant/jobs/film.hpp"

namespace vivant {

/// A rendered shot.
struct LayerFrame {
  int width = 0, height = 0;
  std::vector<float> rgb;     ///< [H, W, 3] not clamped; the person alone is premultiplied with alpha
  std::vector<float> alpha;   ///< [H, W], empty unless the person is alone
  std::vector<float> person;  ///< [H, W], the person's share of each pixel; empty without a scene or a person
  std::vector<float> depth;   ///< [H, W] along the ray, in the cameras' unit; 0 where nothing is
  std::vector<float> features;  ///< [ceil(H/4), ceil(W/4), 256] like the colours; empty unless asked for
};

/// Renders the layers that are asked for: "both", "scene" or "human". A run without a person shows its scene.
class FilmRenderer {
 public:
  /// Renders shots of `film`, which was planned for the person of `run` in the scene of `scene`. Device and
  /// runs must outlive it. Throws UsageError for the person of a run without one.
  FilmRenderer(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
               const std::string& layers, bool features);
  ~FilmRenderer();
  /// A feature is the mean over this many rays a side, spread over its 4 x 4 pixels.
  static constexpr int feature_rays = 3;
  LayerFrame render(const Shot& shot);

 private:
  class Layers;
  static std::vector<float> mean_features(Layers& layers, const Shot& shot);
  std::unique_ptr<Layers> colours_, features_;
};

/// CV_8UC3 RGB; the person alone is put over grey.
cv::Mat to_picture(const LayerFrame& frame);
/// The same, but the person alone as CV_8UC4 RGBA, not premultiplied.
cv::Mat to_picture_with_alpha(const LayerFrame& frame);

/// What is behind the person alone where there must be something.
constexpr float film_grey = 0.75f;

}  // namespace vivant
