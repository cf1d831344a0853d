#pragma once
#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "vivant/jobs/film_renderer.hpp"
#include "vivant/jobs/look.hpp"
#include "vivant/model/brushwork.hpp"
#include "vivant/model/frame_stylizer.hpp"

namespace vivant {

/// How far features may be moved to the painting's. Rendered features are smoother than a picture's, the more
/// the shorter the training, so that some must go beyond.
inline constexpr std::array film_feature_matches = {1.0, 1.25, 1.5, 2.0};

/// The least of `film_feature_matches` whose distance is within 1 % of the least, of those asked for one
/// after another until the distance grows: further costs steadiness and makes colours that the paintings do
/// not have.
double least_good_match(const std::function<double(double match)>& distance);

/// Sets and returns the least good match for the distance of every second of the views, of this size, to the
/// paintings, by their weights. Colours and detail are matched in all views. The paintings must be the
/// stylizer's. Views with a side below 32 pixels are not scored: 1.
double choose_feature_match(Device& device, const Vgg19& vgg, FrameStylizer& stylizer,
                            std::span<const StylePicture> paintings, std::span<const RenderedFrame> views,
                            cv::Size size);

/// The layers that must be painted for the frame in this look, to be put together by the person's share of
/// each pixel; one where they share a style or are alone.
std::vector<Layer> layers_to_paint(const LayerFrame& frame, const Look& look);

/// Throws Error for a run that has learned no features yet, which styles need.
void check_can_stylise(const OpenRun& scene);

/// Paints the frames of a film in one look or several.
class FilmStylizer {
 public:
  /// Uses the stylizer of `scene`, which must outlive this. `renderer` renders features; it makes the film's
  /// reference frames, which say how far features go and from which colours are matched. Throws Error for a
  /// run that has learned no features yet, a picture that cannot be read, and views of several sizes.
  FilmStylizer(Device& device, const OpenRun& scene, const Film& film, FilmRenderer& renderer,
               const std::vector<Look>& looks);
  ~FilmStylizer();

  /// The whole frame's colours [H, W, 3] in the style that the look of this index has for the layer, as
  /// rendered without one. Those of the person alone are not multiplied with alpha.
  std::vector<float> paint(const LayerFrame& frame, std::size_t look, Layer layer);
  /// A painted picture of the layer, CV_32FC3, with the brushwork of the look, which must have some and a
  /// style for the layer.
  cv::Mat with_brushwork(const cv::Mat& picture, const SurfaceTexture& surfaces, std::size_t look,
                         Layer layer) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vivant
