#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "vivant/jobs/film.hpp"
#include "vivant/jobs/film_quality.hpp"
#include "vivant/jobs/look.hpp"

namespace vivant {

/// Where the optical flow of a film comes from.
enum class FlowKind {
  automatic,  ///< geometry, or DIS where the unstylised film changes clearly less with it
  geometry,   ///< of the rendered views: depth of the scene, skinning of the body
  dis  ///< OpenCV's DIS on the capture's pictures, where the film shows them, else on the unstylised film
};

/// What `automatic` is, by the unstylised film's RMSE at gap 1 with either flow: geometry, unless DIS is more
/// than 5 % better. Short trainings know too little of depth, but a tie must not hang on the last digit.
FlowKind better_flow(double by_geometry, double by_dis);

/// A film by another method, made of the unstylised one.
struct OtherFilm {
  std::string name;
  std::filesystem::path path;  ///< an .mp4 or a folder of pictures in the order of their names
  /// Measured a second time, as the mean over frames that our films are (FilmFrames): what the mean is worth
  /// to others.
  bool averaged = false;
};

struct FilmEvaluationOptions {
  std::filesystem::path run;
  std::filesystem::path scene;  ///< as in RenderOptions
  FilmOptions film;
  Look look;
  FlowKind flow = FlowKind::automatic;
  std::vector<OtherFilm> others;
  std::filesystem::path output;  ///< folder for films and report; empty: none
};

/// Renders a film of a run unstylised and in a look and measures both, the latter also without the mean over
/// frames ("vivant-unaveraged"), and films by other methods, against the first painting of the look. The
/// capture's own pictures are measured too when the film shows them. With an output folder: films as .mp4,
/// the unstylised one's frames as pictures in unstylised/, report.json, report.md and index.html. Throws
/// Error, or UsageError for a look without a style.
FilmQuality evaluate_film(Device& device, const FilmEvaluationOptions& options, Progress& progress);

/// "name=path", or a path whose stem is the name. Throws UsageError for an empty name or path.
OtherFilm named_film_from(const std::string& text);

}  // namespace vivant
