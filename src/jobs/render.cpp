#include "vivant/jobs/render.hpp"

#include <algorithm>
#include <memory>

#include "vivant/data/camera_path.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/video.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/open_run.hpp"
#include "vivant/model/view_renderer.hpp"

namespace vivant {
namespace {

std::vector<Camera> cameras_of(const Capture& capture, const std::vector<int>& frames) {
  std::vector<Camera> cameras;
  for (const int frame : frames) cameras.push_back(capture.frames[frame].camera);
  return cameras;
}

CameraPath views_of(const Capture& capture, const RenderOptions& options) {
  CameraPath path{capture.fps, {}};
  if (options.views == "train") {
    path.cameras = cameras_of(capture, capture.training_frames());
  } else if (options.views == "test") {
    path.cameras = cameras_of(capture, capture.held_out_frames());
  } else if (options.views == "orbit") {
    const Camera& reference = capture.frames[capture.frames.size() / 2].camera;
    path.cameras = orbit(reference, focus_point(capture), up_direction(capture), -options.orbit_angle,
                         options.orbit_angle, options.orbit_frames);
  } else if (options.views.ends_with(".json")) {
    path = read_camera_path(options.views);
  } else {
    throw UsageError(
        fmt::format("unknown views '{}': use train, test, orbit or a camera path (.json)", options.views));
  }
  if (options.frames) {
    const auto [first, end] = *options.frames;
    if (first < 0 || end <= first || end > static_cast<int>(path.cameras.size()))
      throw UsageError(
          fmt::format("frames {}:{} are not among the {} views", first, end, path.cameras.size()));
    path.cameras = {path.cameras.begin() + first, path.cameras.begin() + end};
  }
  if (path.cameras.empty()) fail("there are no views to render");
  if (options.size)
    for (Camera& camera : path.cameras) camera = camera.resized(options.size->first, options.size->second);
  return path;
}

}  // namespace

void render(Device& device, const RenderOptions& options, Progress& progress) {
  const OpenRun run = open_run(device, options.run, progress);
  const CameraPath path = views_of(run.capture, options);
  const bool film = options.output.extension() == ".mp4";
  const Camera& first = path.cameras.front();
  std::unique_ptr<VideoWriter> video;
  if (film) {
    for (const Camera& camera : path.cameras)
      if (camera.width != first.width || camera.height != first.height)
        fail("the views have several sizes, a film has one: give --size");
    video = std::make_unique<VideoWriter>(options.output, cv::Size(first.width, first.height), path.fps);
  } else {
    std::filesystem::create_directories(options.output);
  }
  SceneRenderer renderer(device, run.model->scene(), {});
  const InterruptGuard guard;
  const auto count = static_cast<std::int64_t>(path.cameras.size());
  progress.begin("render", 0, count);
  for (std::int64_t i = 0; i < count; ++i) {
    const cv::Mat picture = renderer.render(path.cameras[i]).rgb8();
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
