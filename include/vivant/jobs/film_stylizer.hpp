#pragma once
#include <memory>
#include <vector>

#include "vivant/jobs/film_renderer.hpp"
#include "vivant/jobs/look.hpp"

namespace vivant {

/// How far features and colours are moved to the painting's: further than for single pictures, because
/// rendered features are smoother than a picture's, and the mean over frames (film_frames.hpp) takes contrast
/// from the strokes, which style scores count (docs/evaluation.md).
constexpr double film_feature_match = 1.75, film_colour_match = 0.8;

/// The layers that must be painted for the frame in this look, to be put together by the person's share of
/// each pixel; one where they share a style or are alone.
std::vector<Layer> layers_to_paint(const LayerFrame& frame, const Look& look);

/// Throws Error for a run that has learned no features yet, which styles need.
void check_can_stylise(const OpenRun& scene);

/// Paints the frames of a film in one look or several.
class FilmStylizer {
 public:
  /// Uses the stylizer of `scene`, which must outlive this. `renderer` renders features; it makes the film's
  /// reference frames, from which the colours are matched to the paintings. Throws Error for a run that has
  /// learned no features yet, a picture that cannot be read, and views of several sizes.
  FilmStylizer(Device& device, const OpenRun& scene, const Film& film, FilmRenderer& renderer,
               const std::vector<Look>& looks);
  ~FilmStylizer();

  /// The whole frame's colours [H, W, 3] in the style that the look of this index has for the layer, as
  /// rendered without one. Those of the person alone are not multiplied with alpha.
  std::vector<float> paint(const LayerFrame& frame, std::size_t look, Layer layer);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vivant
