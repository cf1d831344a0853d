#include "vivant/jobs/film_quality.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "vivant/jobs/flow.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/picture_scores.hpp"
#include "vivant/nn/stlpips.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

constexpr std::array<int, 2> consistency_gaps = {1, 7};
constexpr int most_style_frames = 8;
constexpr double least_visible = 0.05;  // of the pixels, for a pair of frames to count

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  int count = 0;
  for (const double value : values)
    if (std::isfinite(value)) sum += value, ++count;
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

/// Adds the score of frame t of every film. Returns the share of visible pixels.
double add_pair(StLpips& perceptual, const std::vector<NamedFilm>& films, const FlowSource& flow, int t,
                int gap, std::vector<FilmScore>& scores) {
  const cv::Mat forward = flow(t, t + gap), visible = visible_pixels(forward, flow(t + gap, t));
  const double share = static_cast<double>(cv::countNonZero(visible)) / visible.size().area();
  for (std::size_t i = 0; i < films.size(); ++i) {
    GapScore& score = scores[i].gaps.back();
    score.stlpips.push_back(std::numeric_limits<double>::quiet_NaN());
    score.rmse.push_back(std::numeric_limits<double>::quiet_NaN());
    if (share < least_visible) continue;
    const cv::Mat& here = films[i].frames[t];
    const cv::Mat there = warped(films[i].frames[t + gap], forward);
    score.rmse.back() = rmse(here, there, visible);
    if (std::min(here.rows, here.cols) >= StLpips::smallest_side)
      score.stlpips.back() = perceptual.distance(here, there, visible);
  }
  return share;
}

nlohmann::ordered_json json_of(const StyleScore& score) {
  return {{"statistics", score.statistics}, {"gram", score.gram}, {"content", score.content}};
}

}  // namespace

void check_alike(const NamedFilm& first, const std::vector<NamedFilm>& films) {
  for (const NamedFilm& film : films) {
    if (film.frames.size() != first.frames.size())
      fail("{} has {} frames, {} has {}", film.name, film.frames.size(), first.name, first.frames.size());
    for (const cv::Mat& frame : film.frames)
      if (frame.size() != first.frames[0].size())
        fail("{} has frames of {}x{}, {} has {}x{}", film.name, frame.cols, frame.rows, first.name,
             first.frames[0].cols, first.frames[0].rows);
  }
}

FilmQuality measure_films(Device& device, const std::vector<NamedFilm>& films, const FlowSource& flow,
                          const cv::Mat& painting, Progress& progress) {
  check_alike(films.at(0), films);
  FilmQuality quality;
  quality.frames = static_cast<int>(films[0].frames.size());
  quality.size = films[0].frames.at(0).size();
  for (const NamedFilm& film : films) quality.films.push_back({film.name, {}, {}, {}});
  StLpips perceptual(device);
  for (const int gap : consistency_gaps) {
    if (quality.frames <= gap) continue;
    for (FilmScore& film : quality.films) film.gaps.push_back({gap, {}, {}});
    double visible = 0;
    progress.begin(fmt::format("consistency, gap {}", gap), 0, quality.frames - gap);
    for (int t = 0; t + gap < quality.frames; ++t) {
      visible += add_pair(perceptual, films, flow, t, gap, quality.films) / (quality.frames - gap);
      progress.report({.step = t + 1});
      if (interrupted()) throw Interrupted("stopped while measuring");
    }
    progress.end();
    for (FilmScore& film : quality.films) {
      film.gaps.back().mean_stlpips = mean_of(film.gaps.back().stlpips);
      film.gaps.back().mean_rmse = mean_of(film.gaps.back().rmse);
    }
    quality.gaps.push_back(gap);
    quality.visible.push_back(visible);
  }
  if (painting.empty()) return quality;

  const Vgg19 vgg(device);
  StyleMeter meter(device, vgg, painting);
  const int count = std::min(most_style_frames, quality.frames);
  for (int i = 0; i < count; ++i) quality.style_frames.push_back((2 * i + 1) * quality.frames / (2 * count));
  progress.begin("style", 0, count);
  for (const int frame : quality.style_frames) {
    for (std::size_t i = 0; i < films.size(); ++i) {
      const StyleScore score = meter.score(films[i].frames[frame], films[0].frames[frame]);
      quality.films[i].style.push_back(score);
      quality.films[i].mean_style.statistics += score.statistics / count;
      quality.films[i].mean_style.gram += score.gram / count;
      quality.films[i].mean_style.content += score.content / count;
    }
    progress.report({.step = static_cast<std::int64_t>(quality.films[0].style.size())});
  }
  progress.end();
  return quality;
}

Report FilmQuality::report() const {
  Report report{"Consistency and style", {}, {{"Films", {"film"}, {}}}, {}, {}};
  report.notes.push_back(fmt::format(
      "{} frames of {}x{}. Optical flow: {}. Consistency: frame t against frame t + gap warped to it, over "
      "the "
      "visible pixels; ST-LPIPS is the shift-tolerant metric, not LPIPS. Lower is better everywhere; figures "
      "count beside those of the unstylised film, the first row.",
      frames, size.width, size.height, flow));
  Report::Table& table = report.tables[0];
  for (std::size_t g = 0; g < gaps.size(); ++g) {
    table.header.push_back(fmt::format("ST-LPIPS gap {}", gaps[g]));
    table.header.push_back(fmt::format("RMSE gap {}", gaps[g]));
    report.notes.push_back(
        fmt::format("Gap {}: {:.1f} % of the pixels are compared.", gaps[g], 100 * visible[g]));
    for (const bool perceptual : {true, false}) {
      Report::Plot plot{
          fmt::format("Consistency, gap {}", gaps[g]), "frame", perceptual ? "ST-LPIPS" : "RMSE", {}};
      for (const FilmScore& film : films)
        plot.curves.push_back({film.name, perceptual ? film.gaps[g].stlpips : film.gaps[g].rmse});
      report.plots.push_back(plot);
    }
  }
  if (!style_frames.empty()) {
    report.notes.push_back(
        fmt::format("Style (distance to the painting) and content (distance to the unstylised film) by "
                    "VGG-19, over {} frames.",
                    style_frames.size()));
    table.header.insert(table.header.end(), {"style: mean, dev.", "style: Gram", "content"});
  }
  for (const FilmScore& film : films) {
    std::vector<std::string> row = {film.name};
    for (const GapScore& gap : film.gaps) {
      row.push_back(cell(gap.mean_stlpips, 4));
      row.push_back(cell(gap.mean_rmse, 4));
    }
    if (!style_frames.empty())
      for (const double number : {film.mean_style.statistics, film.mean_style.gram, film.mean_style.content})
        row.push_back(cell(number, 3));
    table.rows.push_back(row);
  }
  return report;
}

nlohmann::ordered_json FilmQuality::json() const {
  nlohmann::ordered_json all = {{"frames", frames},
                                {"width", size.width},
                                {"height", size.height},
                                {"flow", flow},
                                {"style_frames", style_frames}};
  for (std::size_t g = 0; g < gaps.size(); ++g)
    all["gaps"].push_back({{"gap", gaps[g]}, {"visible", visible[g]}});
  for (const FilmScore& film : films) {
    nlohmann::ordered_json one = {{"film", film.name}};
    for (const GapScore& gap : film.gaps)
      one["consistency"].push_back({{"gap", gap.gap},
                                    {"stlpips", gap.mean_stlpips},
                                    {"rmse", gap.mean_rmse},
                                    {"stlpips_by_frame", gap.stlpips},
                                    {"rmse_by_frame", gap.rmse}});
    if (!film.style.empty()) {
      one["style"] = json_of(film.mean_style);
      for (const StyleScore& score : film.style) one["style"]["by_frame"].push_back(json_of(score));
    }
    all["films"].push_back(one);
  }
  return all;
}

}  // namespace vivant
