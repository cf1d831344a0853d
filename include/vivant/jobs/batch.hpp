#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "vivant/jobs/film.hpp"
#include "vivant/jobs/look.hpp"
#include "vivant/jobs/progress.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// A film to make: its numbered pictures lie in `folder`, the film beside it as `folder`.mp4.
struct BatchFilm {
  std::filesystem::path folder;
  Look look;  ///< without styles the reconstruction
};

/// Films that show the same and differ in their looks alone: every frame is rendered once for all of them.
struct BatchJob {
  std::filesystem::path run, scene;  ///< as in RenderOptions
  FilmOptions film;
  std::string layers = "both";
  std::vector<BatchFilm> films;
};

/// Reads a jobs file (docs/batch.md): lists are multiplied out; paths are relative to the file's folder.
/// Throws UsageError naming file and line for unknown keys (and the nearest known one), wrong values, and two
/// films of one name.
std::vector<BatchJob> load_batch(const std::filesystem::path& path);

/// What became of a film.
struct BatchResult {
  std::filesystem::path film;
  int frames = 0, made = 0;  ///< of the film; by this call
  double seconds = 0;
  std::string error;  ///< empty when the film is whole
};

/// Makes all films. What earlier calls have made is kept; a film that fails does not stop the others. Ctrl-C
/// throws Interrupted after the current frame; the same call goes on from there.
std::vector<BatchResult> run_batch(Device& device, const std::vector<BatchJob>& jobs, Progress& progress);

/// The results as a table.
std::string batch_table(const std::vector<BatchResult>& results);

}  // namespace vivant
