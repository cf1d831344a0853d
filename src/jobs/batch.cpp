#include "vivant/jobs/batch.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <span>

#include "jobs/content_name.hpp"
#include "jobs/elapsed.hpp"
#include "jobs/film_folder.hpp"
#include "vivant/io/image.hpp"
#include "vivant/jobs/film_frames.hpp"
#include "vivant/jobs/film_stylizer.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/model/detail_match.hpp"

namespace vivant {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// The pictures of a mixture with their weights.
std::string mixture_name(const StyleMixture& mixture) {
  if (mixture.empty()) return "none";
  std::vector<std::string> names;
  for (const StyleShare& share : mixture)
    names.push_back(mixture.size() == 1 ? content_name(share.picture)
                                        : fmt::format("{}:{}", content_name(share.picture), share.weight));
  return fmt::format("{}", fmt::join(names, " + "));
}

/// All that decides what a film's pictures look like.
ordered_json settings_of(const BatchJob& job, const BatchFilm& film, const OpenRun& run,
                         const OpenRun& scene) {
  const FilmOptions& options = job.film;
  ordered_json settings = {
      {"run", content_name(run.checkpoint)},
      {"scene", content_name(scene.checkpoint)},
      {"views", options.views.ends_with(".json") ? content_name(options.views) : options.views},
      {"motion", content_name(options.motion)},
      {"motion_names", content_name(options.mapping)},
      {"style", mixture_name(film.look.scene)},
      {"layers", job.layers}};
  if (film.look.layered())
    settings["style"] =
        fmt::format("person {}, scene {}", mixture_name(film.look.person), mixture_name(film.look.scene));
  if (film.look.stylised()) {
    settings["frames_averaged"] = 2 * Film::reach + 1;
    settings["most_detail"] = largest_detail_gain;
    settings["feature_matches"] = film_feature_matches;
    settings["colour_match"] = FrameStylizer::Options{}.colour_match;
    settings["detail_match"] = FrameStylizer::Options{}.detail_match;
    settings["strength"] = film.look.strength;
    settings["keep_colour"] = film.look.keep_colour;
    settings["brushwork"] = film.look.brushwork;
  }
  if (options.views == "orbit") settings["orbit_angle"] = options.orbit_angle;
  if (options.views == "orbit") settings["orbit_frames"] = options.orbit_frames;
  settings["size"] = options.size ? fmt::format("{}x{}", options.size->first, options.size->second) : "own";
  settings["frames"] =
      options.frames ? fmt::format("{}:{}", options.frames->first, options.frames->second) : "all";
  settings["place"] = "own";
  if (const auto& place = options.place)
    settings["place"] = fmt::format("{},{},{},{},{}", place->ground.x(), place->ground.y(), place->ground.z(),
                                    place->yaw, place->units);
  return settings;
}

/// Runs that are open; those that a job does not need are closed.
class OpenRuns {
 public:
  OpenRuns(Device& device, Progress& progress) : device_(device), progress_(progress) {}
  void keep_only(const BatchJob& job) {
    std::erase_if(runs_, [&](const auto& run) { return run.first != job.run && run.first != job.scene; });
  }
  const OpenRun& open(const fs::path& path) {
    const auto found = runs_.find(path);
    return found != runs_.end() ? found->second
                                : runs_.emplace(path, open_run(device_, path, progress_)).first->second;
  }

 private:
  Device& device_;
  Progress& progress_;
  std::map<fs::path, OpenRun> runs_;
};

/// What goes wrong in `action`, empty when nothing does.
template <typename Action>
std::string failure_of(Action&& action) {
  try {
    action();
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

/// A film in the making.
struct OpenFilm {
  const BatchFilm* film;
  FilmFolder folder;
  BatchResult* result;
  bool whole = true;           ///< no picture is missing
  std::size_t look_index = 0;  ///< in the stylizer
};

/// Renders the frames of which a film misses the picture, once for all films.
void render_missing(Device& device, const BatchJob& job, const OpenRun& run, const OpenRun& scene,
                    const Film& film, std::vector<OpenFilm>& films, Progress& progress) {
  std::vector<Look> looks;
  for (OpenFilm& open : films) {
    if (!open.film->look.stylised() || open.whole) continue;
    open.look_index = looks.size();
    looks.push_back(open.film->look);
  }
  FilmFrames frames(device, run, scene, film, job.layers, looks);
  const int count = static_cast<int>(film.shots.size());
  progress.begin("render", 0, count);
  for (int i = 0; i < count; ++i) {
    if (interrupted()) {
      progress.end();
      throw Interrupted("stopped; the same command goes on from here");
    }
    const auto start = std::chrono::steady_clock::now();
    std::vector<OpenFilm*> missing;
    for (OpenFilm& open : films)
      if (!open.folder.has_picture(i)) missing.push_back(&open);
    if (missing.empty()) continue;
    const LayerFrame& rendered = frames.rendered(i);
    const double share = seconds_since(start) / static_cast<double>(missing.size());
    for (OpenFilm* open : missing) {
      const auto own_start = std::chrono::steady_clock::now();
      const bool stylised = open->film->look.stylised();
      write_image(open->folder.picture(i),
                  to_picture_with_alpha(stylised ? frames.stylised(i, open->look_index) : rendered));
      open->result->seconds += share + seconds_since(own_start);
      ++open->result->made;
    }
    progress.report({.step = i + 1, .rays = static_cast<double>(rendered.width) * rendered.height});
  }
  progress.end();
}

/// Makes the films of a job, one result each.
void make_films(Device& device, OpenRuns& runs, const BatchJob& job, std::span<BatchResult> results,
                Progress& progress) {
  const OpenRun& run = runs.open(job.run);
  const OpenRun& scene = job.scene.empty() ? run : runs.open(job.scene);
  const Film film = plan_film(run, scene, job.film);
  const int count = static_cast<int>(film.shots.size());
  film_size(film);
  std::vector<OpenFilm> films;
  for (std::size_t i = 0; i < job.films.size(); ++i)
    results[i].error = failure_of([&] {
      results[i].frames = count;
      check_look(job.films[i].look, job.layers, run.model->human() != nullptr);
      if (job.films[i].look.stylised()) check_can_stylise(scene);
      films.push_back({&job.films[i],
                       FilmFolder(job.films[i].folder, settings_of(job, job.films[i], run, scene)),
                       &results[i]});
      for (int frame = 0; frame < count; ++frame)
        films.back().whole &= films.back().folder.has_picture(frame);
    });
  if (std::any_of(films.begin(), films.end(), [](const OpenFilm& open) { return !open.whole; })) {
    const std::string failure =
        failure_of([&] { render_missing(device, job, run, scene, film, films, progress); });
    for (const OpenFilm& open : films)
      if (!open.whole) open.result->error = failure;
  }
  for (const OpenFilm& open : films) {
    if (!open.result->error.empty() || (open.whole && open.folder.has_film())) continue;
    const auto start = std::chrono::steady_clock::now();
    open.result->error = failure_of([&] { open.folder.write_film(count, film.fps); });
    open.result->seconds += seconds_since(start);
  }
}

}  // namespace

std::vector<BatchResult> run_batch(Device& device, const std::vector<BatchJob>& jobs, Progress& progress) {
  std::vector<BatchResult> results;
  for (const BatchJob& job : jobs)
    for (const BatchFilm& film : job.films)
      results.push_back({fs::path(film.folder).concat(".mp4"), 0, 0, 0, ""});
  OpenRuns runs(device, progress);
  const InterruptGuard guard;
  std::size_t first = 0;
  for (const BatchJob& job : jobs) {
    const std::span<BatchResult> own = std::span(results).subspan(first, job.films.size());
    for (const BatchResult& result : own)
      progress.info(fmt::format("film {} of {}: {}", ++first, results.size(), result.film.string()));
    runs.keep_only(job);
    const std::string failure = failure_of([&] { make_films(device, runs, job, own, progress); });
    for (BatchResult& result : own) {
      if (result.error.empty()) result.error = failure;
      if (!result.error.empty()) progress.warn(fmt::format("{}: {}", result.film.string(), result.error));
    }
  }
  return results;
}

std::string batch_table(const std::vector<BatchResult>& results) {
  std::size_t width = 4;
  for (const BatchResult& result : results) width = std::max(width, result.film.string().size());
  std::string table =
      fmt::format("{:<{}} {:>7} {:>7} {:>9}\n", "film", width, "frames", "made now", "seconds");
  for (const BatchResult& result : results)
    table +=
        fmt::format("{:<{}} {:>7} {:>8} {:>9.1f}{}\n", result.film.string(), width, result.frames,
                    result.made, result.seconds, result.error.empty() ? "" : "  failed: " + result.error);
  return table;
}

}  // namespace vivant
