#include "vivant/jobs/film.hpp"

#include <algorithm>

#include "vivant/data/camera_path.hpp"

namespace vivant {
namespace {

constexpr std::size_t reference_count = 4;

/// Frames of the capture from their own cameras.
bool own_views(const std::string& views) { return views == "all" || views == "train" || views == "test"; }

std::vector<Camera> cameras_of(const Capture& capture, const std::vector<int>& frames) {
  std::vector<Camera> cameras;
  cameras.reserve(frames.size());
  for (const int frame : frames) cameras.push_back(capture.frames[frame].camera);
  return cameras;
}

/// The cameras of the views, and the frames of the capture whose instants they show.
std::pair<CameraPath, std::vector<int>> views_of(const Capture& capture, const FilmOptions& options) {
  check_views(options.views);
  CameraPath path{capture.fps, {}};
  std::vector<int> frames;
  if (own_views(options.views)) {
    frames = options.views == "all"     ? capture.all_frames()
             : options.views == "train" ? capture.training_frames()
                                        : capture.held_out_frames();
    path.cameras = cameras_of(capture, frames);
  } else if (options.views == "orbit") {
    const int middle = static_cast<int>(capture.frames.size() / 2);
    path.cameras = orbit(capture.frames[middle].camera, focus_point(capture), up_direction(capture),
                         -options.orbit_angle, options.orbit_angle, options.orbit_frames);
    frames.assign(path.cameras.size(), middle);
  } else if (options.views == "first") {
    path.cameras = {capture.frames.front().camera};
    frames = {0};
  } else {
    path = read_camera_path(options.views);
    for (std::size_t i = 0; i < path.cameras.size(); ++i)
      frames.push_back(static_cast<int>(std::min(i, capture.frames.size() - 1)));
  }
  if (path.cameras.empty()) fail("there are no views to render");
  return {path, frames};
}

/// Where the scene's person stands when its views begin, if it is not said.
Place place_of(const OpenRun& scene, const FilmOptions& options, int first_frame) {
  if (options.place) return *options.place;
  if (const HumanModel* human = scene.model->human()) {
    const Placement there = standing_at(human->body().body(), scene.capture.human->poses,
                                        scene.capture.frames[first_frame].body_frame);
    return {{there.x, there.y, there.z}, there.yaw};
  }
  const Eigen::Vector3d focus = focus_point(scene.capture);
  const double distance = (scene.capture.frames.front().camera.centre() - focus).norm();
  throw UsageError(fmt::format(
      "{} has no person whose place could be taken: give --place x,y,z,yaw,units (its cameras look at "
      "{:.2f},{:.2f},{:.2f} from {:.2f} units away)",
      scene.folder.path().string(), focus.x(), focus.y(), focus.z(), distance));
}

/// The person in every frame of a motion, which takes the place of the scene's person in `first_frame`.
std::vector<PersonState> animated(const OpenRun& run, const OpenRun& scene, const FilmOptions& options,
                                  int first_frame, double fps) {
  const HumanModel& human = *run.model->human();
  const Body& body = human.body().body();
  const Motion motion =
      placed_in_scene(body, resampled(load_motion(options.motion, body, options.mapping), fps),
                      place_of(scene, options, first_frame), standing_up(scene.capture));
  const HumanModel::CodeRow codes = novel_codes(run.config, human);
  std::vector<PersonState> states;
  states.reserve(motion.frame_count());
  for (int i = 0; i < motion.frame_count(); ++i) states.push_back(novel_state(motion, i, codes));
  return states;
}

/// The person in the given frames of the capture, moved to the place when there is one or, when the scene is
/// another's, to where its person is in `first_frame`.
std::vector<PersonState> captured(const OpenRun& run, const OpenRun& scene, const FilmOptions& options,
                                  int first_frame, const std::vector<int>& frames) {
  const HumanModel& human = *run.model->human();
  std::vector<PersonState> states;
  states.reserve(frames.size());
  for (const int frame : frames) states.push_back(captured_state(human, run.capture, frame));
  if (&scene == &run && !options.place) return states;
  const Motion motion = placed_in_scene(human.body().body(), run.capture.human->poses,
                                        place_of(scene, options, first_frame), standing_up(scene.capture));
  for (std::size_t i = 0; i < frames.size(); ++i)
    states[i] = novel_state(motion, run.capture.frames[frames[i]].body_frame, states[i].codes);
  return states;
}

/// A shot for every state of the person, the cameras spread evenly over them.
std::vector<Shot> spread(const std::vector<Camera>& cameras, const std::vector<PersonState>& states) {
  std::vector<Shot> shots;
  for (std::size_t i = 0; i < states.size(); ++i)
    shots.push_back({cameras[i * cameras.size() / states.size()], states[i]});
  return shots;
}

Film whole_film(const OpenRun& run, const OpenRun& scene, const FilmOptions& options) {
  const bool elsewhere = &scene != &run, has_person = run.model->human() != nullptr;
  if (!has_person && (elsewhere || options.place || !options.motion.empty()))
    throw UsageError(fmt::format("{} has no person", run.folder.path().string()));
  const auto [path, frames] = views_of(scene.capture, options);
  const int first = frames.front();
  Film film;
  film.fps = path.fps;
  if (options.place) film.units_per_metre = options.place->units;
  if (elsewhere) film.light = turn_of_up(standing_up(scene.capture), standing_up(run.capture));
  if (!options.motion.empty()) {
    film.shots = spread(path.cameras, animated(run, scene, options, first, film.fps));
  } else if (elsewhere) {
    film.fps = run.capture.fps;
    film.shots = spread(path.cameras, captured(run, scene, options, first, run.capture.all_frames()));
  } else if (has_person) {
    film.shots = spread(path.cameras, captured(run, scene, options, first, frames));
    film.known_poses = !options.place && own_views(options.views);
  } else {
    for (const Camera& camera : path.cameras) film.shots.push_back({camera, std::nullopt});
  }
  if (own_views(options.views) && !elsewhere && !options.place && options.motion.empty())
    for (std::size_t i = 0; i < film.shots.size(); ++i) film.shots[i].capture_frame = frames[i];
  return film;
}

/// At most `count` of them, spread evenly.
template <typename T>
std::vector<T> some_of(const std::vector<T>& all, std::size_t count) {
  std::vector<T> some;
  for (std::size_t i = 0; i < std::min(count, all.size()); ++i)
    some.push_back(all[(2 * i + 1) * all.size() / (2 * std::min(count, all.size()))]);
  return some;
}

std::vector<Shot> reference_shots(const OpenRun& run, const OpenRun& scene, const Film& film) {
  if (&scene != &run) return some_of(film.shots, reference_count);
  std::vector<Shot> shots;
  for (const int frame : some_of(run.capture.training_frames(), reference_count)) {
    shots.push_back({run.capture.frames[frame].camera, std::nullopt});
    if (const HumanModel* human = run.model->human())
      shots.back().person = captured_state(*human, run.capture, frame);
  }
  return shots;
}

}  // namespace

void check_views(const std::string& views) {
  for (const char* known : {"all", "train", "test", "first", "orbit"})
    if (views == known) return;
  if (!views.ends_with(".json"))
    throw UsageError(fmt::format(
        "unknown views '{}': use all, train, test, first, orbit or a camera path (.json)", views));
}

Film plan_film(const OpenRun& run, const OpenRun& scene, const FilmOptions& options) {
  Film film = whole_film(run, scene, options);
  film.references = reference_shots(run, scene, film);
  if (options.frames) {
    const auto [first, end] = *options.frames;
    if (first < 0 || end <= first || end > static_cast<int>(film.shots.size()))
      throw UsageError(fmt::format("frames {}:{} are not among the {} views", first, end, film.shots.size()));
    const auto part = [&, all = film.shots](int from, int to) {
      const int count = static_cast<int>(all.size());
      return std::vector<Shot>(all.begin() + std::max(from, 0), all.begin() + std::min(to, count));
    };
    film.before = part(first - Film::reach, first);
    film.shots = part(first, end);
    film.after = part(end, end + Film::reach);
  }
  if (options.size)
    for (std::vector<Shot>* shots : {&film.before, &film.shots, &film.after})
      for (Shot& shot : *shots) shot.camera = shot.camera.resized(options.size->first, options.size->second);
  for (Shot& shot : film.references)
    shot.camera = shot.camera.resized(film.shots.front().camera.width, film.shots.front().camera.height);
  return film;
}

bool Film::has_shot(int index) const {
  return index >= -static_cast<int>(before.size()) && index < static_cast<int>(shots.size() + after.size());
}

const Shot& Film::shot(int index) const {
  const int count = static_cast<int>(shots.size());
  if (index < 0) return before.at(static_cast<int>(before.size()) + index);
  return index < count ? shots[index] : after.at(index - count);
}

cv::Size film_size(const Film& film) {
  const Camera& first = film.shots.front().camera;
  for (const Shot& shot : film.shots)
    if (shot.camera.width != first.width || shot.camera.height != first.height)
      fail("the views have several sizes, a film has one: give --size");
  return {first.width, first.height};
}

}  // namespace vivant
