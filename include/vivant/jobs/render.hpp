#pragma once
#include <filesystem>
#include <string>

#include "vivant/jobs/film.hpp"
#include "vivant/jobs/look.hpp"
#include "vivant/jobs/progress.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

struct RenderOptions {
  std::filesystem::path run;
  std::filesystem::path scene;  ///< another run, whose scene the person is put into; empty: their own
  FilmOptions film;
  std::string layers = "both";   ///< both, scene or human
  Look look;                     ///< of the film; without styles the reconstruction
  std::filesystem::path output;  ///< a film (.mp4), or a folder for numbered pictures
};

/// Renders a film of a run. Layer `human` is the person alone, as RGBA pictures or over grey in a film. A
/// film has its name when it is whole; pictures are kept one by one.
void render(Device& device, const RenderOptions& options, Progress& progress);

}  // namespace vivant
