#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vivant/jobs/open_run.hpp"
#include "vivant/jobs/placing.hpp"

namespace vivant {

/// What a film shows: from where, and what the person does.
struct FilmOptions {
  std::string views = "test";  ///< all, train, test, first, orbit, or a camera path as a JSON file
  double orbit_angle = 30;     ///< degrees to each side, for views = orbit
  int orbit_frames = 48;
  std::optional<std::pair<int, int>> size = {};    ///< of the pictures; else the cameras' own
  std::optional<std::pair<int, int>> frames = {};  ///< the shots [first, end)
  std::filesystem::path motion =
      {};  ///< animates the person: poses, BVH or AMASS; empty: the capture's own poses
  std::filesystem::path mapping = {};  ///< names of a BVH file's joints, see load_motion
  std::optional<Place> place = {};     ///< of the person; else where the person of the scene's capture starts
};

/// Throws UsageError for other views than the ones above.
void check_views(const std::string& views);

/// A picture to make: from where, and what the person does in it (nothing in a run without one).
struct Shot {
  Camera camera;
  std::optional<PersonState> person;
  int capture_frame = -1;  ///< of the run's capture, when it is that frame from its own camera
};

/// The plan of a film: its shots, in order.
struct Film {
  /// How many shots before and after a shot its stylised picture depends on (film_frames.hpp).
  static constexpr int reach = 3;
  double fps = 24;
  std::vector<Shot> shots;
  std::vector<Shot> before,
      after;  ///< next to the shots when they are a part of a film; at most `reach` each
  /// Shots that show what the film's colours are, from which they are matched to a painting: in its own scene
  /// training frames, the same for every film of the run, so that all its films have the same colours.
  std::vector<Shot> references;
  bool known_poses = false;    ///< frames of the capture from their own cameras
  double units_per_metre = 1;  ///< of the cameras' world; the person is in metres
  /// Turns the cameras' world into that of the run, in which the light on the person was learned.
  Eigen::Matrix3d light = Eigen::Matrix3d::Identity();

  /// The shot `index`, or one next to the shots: from -before.size() to shots.size() + after.size(),
  /// exclusive.
  bool has_shot(int index) const;
  const Shot& shot(int index) const;
};

/// The film of the person of `run` in the scene of `scene`, which may be the same; cameras are those of
/// `scene`. In its own scene and without a motion the person does what the views show: the capture's own
/// views show their frames, an orbit the instant of the capture's middle frame, the views of a camera path
/// frame after frame. With a motion, or in another scene (there the capture's own poses are the motion), the
/// film is as long as the motion and the views are spread over it. Throws UsageError for unknown views,
/// frames that do not exist, a motion or another scene without a person, and a scene without a person of its
/// own when no place is given.
Film plan_film(const OpenRun& run, const OpenRun& scene, const FilmOptions& options);

/// All frames have this size. Throws Error when the views have several.
cv::Size film_size(const Film& film);

}  // namespace vivant
