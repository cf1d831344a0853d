#pragma once
#include <filesystem>
#include <memory>
#include <vector>

#include "vivant/jobs/film_renderer.hpp"

namespace vivant {

/// Throws Error for a run that has learned no features yet, which styles need.
void check_can_stylise(const OpenRun& scene);

/// Paints the frames of a film in one style or several.
class FilmStylizer {
 public:
  /// Uses the stylizer of `scene`, which must outlive this. `renderer` renders features; it makes the film's
  /// reference frames, from which the colours are matched to the paintings. Throws Error for a run that has
  /// learned no features yet, a picture that cannot be read, and views of several sizes.
  FilmStylizer(Device& device, const OpenRun& scene, const Film& film, FilmRenderer& renderer,
               const std::vector<std::filesystem::path>& styles);
  ~FilmStylizer();

  /// The frame in the style of this index. strength blends from the reconstruction (0) to the style (1).
  LayerFrame stylise(const LayerFrame& frame, std::size_t style, double strength);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vivant
