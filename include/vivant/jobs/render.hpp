#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "vivant/jobs/progress.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

struct RenderOptions {
  std::filesystem::path run;
  std::string views = "test";  ///< train, test, orbit, or a camera path as a JSON file
  double orbit_angle = 30;     ///< degrees to each side, for views = orbit
  int orbit_frames = 48;
  std::optional<std::pair<int, int>> size;    ///< of the pictures; else the cameras' own
  std::optional<std::pair<int, int>> frames;  ///< the views [first, end)
  std::filesystem::path output;               ///< a film (.mp4), or a folder for numbered pictures
};

/// Renders views of a run's background. A film has its name when it is whole; pictures are kept one by one.
void render(Device& device, const RenderOptions& options, Progress& progress);

}  // namespace vivant
