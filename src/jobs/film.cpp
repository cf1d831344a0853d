#include "vivant/jobs/film.hpp"

#include <algorithm>

#include "vivant/data/camera_path.hpp"

namespace vivant {
namespace {

std::vector<Camera> cameras_of(const Capture& capture, const std::vector<int>& frames) {
  std::vector<Camera> cameras;
  for (const int frame : frames) cameras.push_back(capture.frames[frame].camera);
  return cameras;
}

/// The cameras of the views, and the frames of the capture whose instants they show.
std::pair<CameraPath, std::vector<int>> views_of(const Capture& capture, const FilmOptions& options) {
  CameraPath path{capture.fps, {}};
  std::vector<int> frames;
  if (options.views == "train" || options.views == "test") {
    frames = options.views == "train" ? capture.training_frames() : capture.held_out_frames();
    path.cameras = cameras_of(capture, frames);
  } else if (options.views == "orbit") {
    const int middle = static_cast<int>(capture.frames.size() / 2);
    path.cameras = orbit(capture.frames[middle].camera, focus_point(capture), up_direction(capture),
                         -options.orbit_angle, options.orbit_angle, options.orbit_frames);
    frames.assign(path.cameras.size(), middle);
  } else if (options.views == "first") {
    path.cameras = {capture.frames.front().camera};
    frames = {0};
  } else if (options.views.ends_with(".json")) {
    path = read_camera_path(options.views);
    for (std::size_t i = 0; i < path.cameras.size(); ++i)
      frames.push_back(static_cast<int>(std::min(i, capture.frames.size() - 1)));
  } else {
    throw UsageError(fmt::format("unknown views '{}': use train, test, first, orbit or a camera path (.json)",
                                 options.views));
  }
  if (path.cameras.empty()) fail("there are no views to render");
  return {path, frames};
}

/// The motion's frames, each from one of the views, spread evenly.
void animate(const OpenRun& run, const FilmOptions& options, const CameraPath& path, Film& film) {
  const HumanModel& human = *run.model->human();
  const Body& body = human.body().body();
  const Motion loaded = resampled(load_motion(options.motion, body, options.mapping), film.fps);
  const Motion motion = placed(body, loaded, start_of(body, run.capture.human->poses));
  const HumanModel::CodeRow codes = novel_codes(run.config, human);
  for (int i = 0; i < motion.frame_count(); ++i)
    film.shots.push_back(
        {path.cameras[i * path.cameras.size() / motion.frame_count()], novel_state(motion, i, codes)});
}

}  // namespace

Film plan_film(const OpenRun& run, const FilmOptions& options) {
  const HumanModel* human = run.model->human();
  if (!human && !options.motion.empty())
    throw UsageError(fmt::format("{} has no person", run.folder.path().string()));
  const auto [path, frames] = views_of(run.capture, options);
  Film film{path.fps, {}, options.motion.empty() && (options.views == "train" || options.views == "test")};
  if (!options.motion.empty()) {
    animate(run, options, path, film);
  } else {
    for (std::size_t i = 0; i < path.cameras.size(); ++i) {
      film.shots.push_back({path.cameras[i], std::nullopt});
      if (human) film.shots.back().person = captured_state(*human, run.capture, frames[i]);
    }
  }
  if (options.frames) {
    const auto [first, end] = *options.frames;
    if (first < 0 || end <= first || end > static_cast<int>(film.shots.size()))
      throw UsageError(fmt::format("frames {}:{} are not among the {} views", first, end, film.shots.size()));
    film.shots = {film.shots.begin() + first, film.shots.begin() + end};
  }
  if (options.size)
    for (Shot& shot : film.shots)
      shot.camera = shot.camera.resized(options.size->first, options.size->second);
  return film;
}

}  // namespace vivant
