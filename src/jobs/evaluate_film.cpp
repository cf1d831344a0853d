#include "vivant/jobs/evaluate_film.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>

#include "vivant/io/atomic_file.hpp"
#include "vivant/io/frames.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/video.hpp"
#include "vivant/jobs/film_frames.hpp"
#include "vivant/jobs/flow.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/picture_scores.hpp"

namespace vivant {
namespace {

namespace fs = std::filesystem;

/// Our films, other methods' films after the same mean over frames, and the geometry of the views.
struct Rendered {
  NamedFilm plain{"unstylised", {}}, stylised{"vivant", {}}, unaveraged{"vivant-unaveraged", {}};
  std::vector<NamedFilm> averaged;
  std::vector<SurfaceView> views;
};

std::string averaged_name(const std::string& film) { return film + "-averaged"; }

Rendered render_films(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
                      const Look& look, const std::vector<NamedFilm>& to_average, Progress& progress) {
  FilmFrames frames(device, run, scene, film, "both", {look});
  Rendered rendered;
  for (const NamedFilm& other : to_average) rendered.averaged.push_back({averaged_name(other.name), {}});
  const InterruptGuard guard;
  const int count = static_cast<int>(film.shots.size());
  progress.begin("render", 0, count);
  for (int shot = 0; shot < count; ++shot) {
    rendered.plain.frames.push_back(to_picture(frames.rendered(shot)));
    rendered.views.push_back(frames.surface(shot));
    rendered.stylised.frames.push_back(to_picture(frames.stylised(shot, 0)));
    rendered.unaveraged.frames.push_back(to_picture(frames.painted_alone(shot, 0)));
    for (std::size_t i = 0; i < to_average.size(); ++i)
      rendered.averaged[i].frames.push_back(frames.averaged(shot, to_average[i].frames));
    progress.report({.step = shot + 1});
    if (interrupted()) throw Interrupted("stopped while rendering");
  }
  progress.end();
  return rendered;
}

/// The capture's pictures in the film's size; none unless every shot is one.
std::vector<cv::Mat> captured_pictures(const Capture& capture, const Film& film) {
  std::vector<cv::Mat> pictures;
  for (const Shot& shot : film.shots) {
    if (shot.capture_frame < 0 || !fs::exists(capture.frames[shot.capture_frame].image_path)) return {};
    cv::Mat picture = capture.taken_image(shot.capture_frame), resized;
    cv::resize(picture, resized, {shot.camera.width, shot.camera.height}, 0, 0, cv::INTER_AREA);
    pictures.push_back(resized);
  }
  return pictures;
}

void write_films(const fs::path& folder, const std::vector<NamedFilm>& films, double fps, Report& report) {
  make_folder(folder / "unstylised");
  for (std::size_t i = 0; i < films[0].frames.size(); ++i)
    write_image(folder / "unstylised" / fmt::format("{:04}.png", i), films[0].frames[i]);
  for (const NamedFilm& film : films) {
    const fs::path file = folder / (film.name + ".mp4");
    VideoWriter video(file, film.frames[0].size(), fps);
    for (const cv::Mat& frame : film.frames) video.write(frame);
    video.close();
    report.videos.push_back({film.name, file});
  }
}

/// The mean error of a film against its next frames, warped by each of two flows, over the pixels that both
/// trust.
std::array<double, 2> errors_with(const std::vector<cv::Mat>& frames,
                                  const std::array<FlowSource, 2>& flows) {
  std::array<double, 2> sums = {};
  int pairs = 0;
  for (int t = 0; t + 1 < static_cast<int>(frames.size()); ++t) {
    const std::array<cv::Mat, 2> forward = {flows[0](t, t + 1), flows[1](t, t + 1)};
    const cv::Mat visible =
        visible_pixels(forward[0], flows[0](t + 1, t)) & visible_pixels(forward[1], flows[1](t + 1, t));
    if (cv::countNonZero(visible) == 0) continue;
    ++pairs;
    for (int i : {0, 1}) sums[i] += rmse(frames[t], warped(frames[t + 1], forward[i]), visible);
  }
  for (double& sum : sums) sum /= std::max(pairs, 1);
  return sums;
}

/// The flow that measures a film, and where it comes from.
struct ChosenFlow {
  FlowSource source;
  std::string name;
};

ChosenFlow chosen_flow(FlowKind kind, const FlowSource& geometry, const FlowSource& dis, bool captured,
                       const std::vector<cv::Mat>& unstylised) {
  const ChosenFlow of_geometry{geometry, "geometry of the rendered views"};
  const ChosenFlow of_dis{dis, captured ? "DIS on the capture's pictures" : "DIS on the unstylised film"};
  if (kind != FlowKind::automatic) return kind == FlowKind::dis ? of_dis : of_geometry;
  const auto [by_geometry, by_dis] = errors_with(unstylised, {geometry, dis});
  ChosenFlow chosen = better_flow(by_geometry, by_dis) == FlowKind::dis ? of_dis : of_geometry;
  chosen.name += fmt::format(
      " (chosen: where both can be trusted, the unstylised film's RMSE at gap 1 is {:.4f} by geometry, "
      "{:.4f} "
      "by DIS)",
      by_geometry, by_dis);
  return chosen;
}

}  // namespace

FlowKind better_flow(double by_geometry, double by_dis) {
  return by_dis < 0.95 * by_geometry ? FlowKind::dis : FlowKind::geometry;
}

FilmQuality evaluate_film(Device& device, const FilmEvaluationOptions& options, Progress& progress) {
  if (!options.look.stylised()) throw UsageError("a film is evaluated in a style: give --style");
  const OpenRun run = open_run(device, options.run, progress);
  std::optional<OpenRun> other;
  if (!options.scene.empty()) other.emplace(open_run(device, options.scene, progress));
  const OpenRun& scene = other ? *other : run;
  const Film film = plan_film(run, scene, options.film);
  check_look(options.look, "both", run.model->human() != nullptr);
  std::vector<NamedFilm> others, to_average;
  std::set<std::string> names = {"unstylised", "capture", "vivant", "vivant-unaveraged"};
  const auto take_name = [&](const std::string& name) {
    if (!names.insert(name).second)
      throw UsageError(fmt::format("two films are called '{}': rename one", name));
  };
  for (const OtherFilm& given : options.others) {
    take_name(given.name);
    others.push_back({given.name, read_frames(given.path).pictures});
    if (!given.averaged) continue;
    take_name(averaged_name(given.name));
    to_average.push_back(others.back());
  }
  const std::vector<cv::Mat> blank(film.shots.size(), cv::Mat(film_size(film), CV_8UC3));
  check_alike({"the run's film", blank}, others);  // before minutes of rendering

  Rendered rendered = render_films(device, run, scene, film, options.look, to_average, progress);
  const std::vector<cv::Mat> captured = captured_pictures(run.capture, film);
  const std::vector<cv::Mat>& seen = captured.empty() ? rendered.plain.frames : captured;
  const HumanModel* human = run.model->human();
  const SurfaceFlow surface(human ? &human->body().body() : nullptr, film.units_per_metre);
  const ChosenFlow flow = chosen_flow(
      options.flow, [&](int from, int to) { return surface.flow(rendered.views[from], rendered.views[to]); },
      [&](int from, int to) { return dis_flow(seen[from], seen[to]); }, !captured.empty(),
      rendered.plain.frames);
  std::vector<NamedFilm> films = {rendered.plain, rendered.stylised, rendered.unaveraged};
  if (!captured.empty()) films.insert(films.begin() + 1, {"capture", captured});
  films.insert(films.end(), others.begin(), others.end());
  films.insert(films.end(), rendered.averaged.begin(), rendered.averaged.end());
  const StyleMixture& style = options.look.scene.empty() ? options.look.person : options.look.scene;
  FilmQuality quality = measure_films(device, films, flow.source, read_image(style[0].picture), progress);
  quality.flow = flow.name;
  if (options.output.empty()) return quality;
  make_folder(options.output);
  Report report = quality.report();
  write_films(options.output, films, film.fps, report);
  write_report(options.output, report, quality.json());
  return quality;
}

OtherFilm named_film_from(const std::string& text) {
  const std::size_t equals = text.find('=');
  const fs::path path = equals == std::string::npos ? text : text.substr(equals + 1);
  const std::string name =
      equals == std::string::npos ? path.lexically_normal().stem().string() : text.substr(0, equals);
  if (name.empty() || path.empty() || name.find('/') != std::string::npos)
    throw UsageError(fmt::format("a film is NAME=PATH, a file or a folder of pictures, not '{}'", text));
  return {name, path};
}

}  // namespace vivant
