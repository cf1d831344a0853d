#include "vivant/jobs/render.hpp"

#include <memory>

#include "vivant/io/atomic_file.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/video.hpp"
#include "vivant/jobs/film_frames.hpp"
#include "vivant/jobs/interrupt.hpp"

namespace vivant {
void render(Device& device, const RenderOptions& options, Progress& progress) {
  for (const char* other : {".avi", ".mov", ".mkv", ".webm", ".gif", ".png", ".jpg"})
    if (options.output.extension() == other)
      throw UsageError(
          fmt::format("-o {}: films are .mp4 files, or folders of pictures", options.output.string()));
  const OpenRun run = open_run(device, options.run, progress);
  std::optional<OpenRun> other;
  if (!options.scene.empty()) other.emplace(open_run(device, options.scene, progress));
  const OpenRun& scene = other ? *other : run;
  const Film film = plan_film(run, scene, options.film);
  check_look(options.look, options.layers, run.model->human() != nullptr);  // before there is any output
  std::unique_ptr<VideoWriter> video;
  if (options.output.extension() == ".mp4")
    video = std::make_unique<VideoWriter>(options.output, film_size(film), film.fps);
  else
    make_folder(options.output);
  const bool stylised = options.look.stylised();
  FilmFrames frames(device, run, scene, film, options.layers,
                    stylised ? std::vector{options.look} : std::vector<Look>{});
  const InterruptGuard guard;
  const auto count = static_cast<std::int64_t>(film.shots.size());
  progress.begin("render", 0, count);
  for (std::int64_t i = 0; i < count; ++i) {
    const int shot = static_cast<int>(i);
    const LayerFrame frame = stylised ? frames.stylised(shot, 0) : frames.rendered(shot);
    if (video)
      video->write(to_picture(frame));
    else
      write_image(options.output / fmt::format("{:04}.png", i), to_picture_with_alpha(frame));
    progress.report({.step = i + 1, .rays = static_cast<double>(frame.width) * frame.height});
    if (interrupted() && i + 1 < count) {
      progress.end();
      throw Interrupted(fmt::format("stopped after {} of {} views", i + 1, count));
    }
  }
  if (video) video->close();
  progress.end();
}

}  // namespace vivant
