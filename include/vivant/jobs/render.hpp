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
  std::filesystem::path motion;  ///< animates the person: poses, BVH or AMASS; empty: the capture's own poses
  std::filesystem::path mapping;  ///< names of a BVH file's joints, see load_motion
  std::string layers = "both";    ///< both, scene or human
  std::filesystem::path output;   ///< a film (.mp4), or a folder for numbered pictures
};

/// Renders views of a run. Training and held-out views show the person as in their frames; an orbit shows the
/// instant of the capture's middle frame; the views of a camera path show frame after frame. With a motion
/// the film is as long as the motion, which starts where the person starts in the capture, and the views are
/// spread over it (the default views: the capture's first camera). Layer `human` is the person alone, as RGBA
/// pictures or over grey in a film. A film has its name when it is whole; pictures are kept one by one.
void render(Device& device, const RenderOptions& options, Progress& progress);

}  // namespace vivant
