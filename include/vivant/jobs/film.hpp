#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vivant/jobs/open_run.hpp"

namespace vivant {

/// What a film shows: from where, and what the person does.
struct FilmOptions {
  std::string views = "test";  ///< train, test, first, orbit, or a camera path as a JSON file
  double orbit_angle = 30;     ///< degrees to each side, for views = orbit
  int orbit_frames = 48;
  std::optional<std::pair<int, int>> size;    ///< of the pictures; else the cameras' own
  std::optional<std::pair<int, int>> frames;  ///< the shots [first, end)
  std::filesystem::path motion;  ///< animates the person: poses, BVH or AMASS; empty: the capture's own poses
  std::filesystem::path mapping;  ///< names of a BVH file's joints, see load_motion
};

/// A picture to make: from where, and what the person does in it (nothing in a run without one).
struct Shot {
  Camera camera;
  std::optional<PersonState> person;
};

/// The plan of a film: its shots, in order.
struct Film {
  double fps = 24;
  std::vector<Shot> shots;
  bool known_poses = false;  ///< frames of the capture from their own cameras
};

/// Training and held-out views show the person as in their frames; an orbit shows the instant of the
/// capture's middle frame; the views of a camera path show frame after frame. With a motion the film is as
/// long as the motion, which starts where the person starts in the capture, and the views are spread over it.
/// Throws UsageError for unknown views, frames that do not exist, or a motion in a run without a person.
Film plan_film(const OpenRun& run, const FilmOptions& options);

}  // namespace vivant
