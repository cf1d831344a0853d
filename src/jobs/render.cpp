#include "vivant/jobs/render.hpp"

#include <algorithm>
#include <memory>

#include "vivant/data/camera_path.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/video.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/open_run.hpp"
#include "vivant/model/composite_renderer.hpp"

namespace vivant {
namespace {

/// A picture to make: from where, and what the person does in it (nothing in a run without one).
struct Shot {
  Camera camera;
  std::optional<PersonState> person;
};

struct Film {
  double fps = 24;
  std::vector<Shot> shots;
  bool known_poses = false;  ///< frames of the capture from their own cameras
};

std::vector<Camera> cameras_of(const Capture& capture, const std::vector<int>& frames) {
  std::vector<Camera> cameras;
  for (const int frame : frames) cameras.push_back(capture.frames[frame].camera);
  return cameras;
}

/// The cameras of the views, and the frames of the capture whose instants they show.
std::pair<CameraPath, std::vector<int>> views_of(const Capture& capture, const RenderOptions& options) {
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
void animate(const OpenRun& run, const RenderOptions& options, const CameraPath& path, Film& film) {
  const HumanModel& human = *run.model->human();
  const Body& body = human.body().body();
  const Motion loaded = resampled(load_motion(options.motion, body, options.mapping), film.fps);
  const Motion motion = placed(body, loaded, start_of(body, run.capture.human->poses));
  const HumanModel::CodeRow codes = novel_codes(run.config, human);
  for (int i = 0; i < motion.frame_count(); ++i)
    film.shots.push_back(
        {path.cameras[i * path.cameras.size() / motion.frame_count()], novel_state(motion, i, codes)});
}

Film film_of(const OpenRun& run, const RenderOptions& options) {
  const HumanModel* human = run.model->human();
  if (!human && (!options.motion.empty() || options.layers == "human"))
    throw UsageError(fmt::format("{} has no person", options.run.string()));
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

/// Renders the layers that are asked for, as CV_8UC3 RGB or, for the person alone in pictures, CV_8UC4.
class LayerRenderer {
 public:
  LayerRenderer(Device& device, const OpenRun& run, const std::string& layers, bool known_poses) {
    const HumanModel* human = layers == "scene" ? nullptr : run.model->human();
    const HumanRenderer::Options options = human_renderer_options(run.config, known_poses);
    if (layers == "human")
      human_.emplace(device, *human, options);
    else if (human)
      both_.emplace(device, run.model->scene(), *human, options);
    else
      scene_.emplace(device, run.model->scene(), SceneRenderer::Options{});
  }
  cv::Mat render(const Shot& shot, bool with_alpha) {
    if (scene_) return scene_->render(shot.camera).rgb8();
    if (both_) return both_->render(shot.camera, *shot.person).picture.rgb8();
    const PersonView view = human_->render(shot.camera, *shot.person);
    if (with_alpha) return view.rgba8(shot.camera.width, shot.camera.height);
    cv::Mat picture(shot.camera.height, shot.camera.width, CV_8UC3, cv::Scalar::all(192));
    view.draw_over(picture);
    return picture;
  }

 private:
  std::optional<SceneRenderer> scene_;
  std::optional<HumanRenderer> human_;
  std::optional<CompositeRenderer> both_;
};

}  // namespace

void render(Device& device, const RenderOptions& options, Progress& progress) {
  const OpenRun run = open_run(device, options.run, progress);
  const Film plan = film_of(run, options);
  const bool film = options.output.extension() == ".mp4";
  const Camera& first = plan.shots.front().camera;
  std::unique_ptr<VideoWriter> video;
  if (film) {
    for (const Shot& shot : plan.shots)
      if (shot.camera.width != first.width || shot.camera.height != first.height)
        fail("the views have several sizes, a film has one: give --size");
    video = std::make_unique<VideoWriter>(options.output, cv::Size(first.width, first.height), plan.fps);
  } else {
    std::filesystem::create_directories(options.output);
  }
  LayerRenderer renderer(device, run, options.layers, plan.known_poses);
  const InterruptGuard guard;
  const auto count = static_cast<std::int64_t>(plan.shots.size());
  progress.begin("render", 0, count);
  for (std::int64_t i = 0; i < count; ++i) {
    const cv::Mat picture = renderer.render(plan.shots[i], !film);
    if (film)
      video->write(picture);
    else
      write_image(options.output / fmt::format("{:04}.png", i), picture);
    progress.report({.step = i + 1, .rays = static_cast<double>(picture.total())});
    if (interrupted() && i + 1 < count) {
      progress.end();
      throw Interrupted(fmt::format("stopped after {} of {} views", i + 1, count));
    }
  }
  if (film) video->close();
  progress.end();
}

}  // namespace vivant
