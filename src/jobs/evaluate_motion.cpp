#include "vivant/jobs/evaluate_motion.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "vivant/io/atomic_file.hpp"
#include "vivant/io/video.hpp"
#include "vivant/jobs/film_renderer.hpp"
#include "vivant/jobs/interrupt.hpp"

namespace vivant {
namespace {

/// What is measured of every frame; the frame with the worst value stands for the film's worst moment.
struct Figure {
  const char *name, *title;  ///< in JSON, in the report
  bool high_is_worse;
  bool names_limb;  ///< whether the value is that of MotionFrameScore::least_limb
  std::function<std::optional<double>(const MotionFrameScore&)> value;
};

const std::vector<Figure>& figures() {
  static const std::vector<Figure> all = {
      {"silhouette_iou", "silhouette's IoU", false, false,
       [](const MotionFrameScore& score) { return score.silhouette_iou; }},
      {"least_limb", "least covered limb", false, true,
       [](const MotionFrameScore& score) {
         return score.least_limb ? std::optional(score.least_limb->share) : std::nullopt;
       }},
      {"detached", "detached pieces", true, false,
       [](const MotionFrameScore& score) { return score.detached; }}};
  return all;
}

/// A figure over all frames that have it.
struct Summary {
  double mean = NAN, worst = NAN;
  int worst_frame = -1;
  int count = 0;  ///< frames that have the figure
};

Summary summary_of(const Figure& figure, const std::vector<MotionFrameScore>& frames) {
  Summary summary;
  double sum = 0;
  for (int i = 0; i < static_cast<int>(frames.size()); ++i) {
    const std::optional<double> value = figure.value(frames[i]);
    if (!value) continue;
    sum += *value;
    ++summary.count;
    const bool worse = figure.high_is_worse ? *value > summary.worst : *value < summary.worst;
    if (summary.count == 1 || worse) summary.worst = *value, summary.worst_frame = i;
  }
  if (summary.count > 0) summary.mean = sum / summary.count;
  return summary;
}

/// The limb that the least covered limb's figure is about; empty for the other figures.
std::string limb_of(const Figure& figure, const MotionFrameScore& score) {
  return figure.names_limb && score.least_limb ? score.least_limb->limb : "";
}

}  // namespace

Report MotionEvaluation::report() const {
  Report report{
      "Novel poses: the rendered person and the posed body",
      {"Silhouette's IoU: of the rendered person and the posed body. Clothes and hair lie outside of "
       "the body: of a dressed person it is below 1. Least covered limb: the share of its visible "
       "pixels that the rendered person covers; near 0 the limb is missing. Detached pieces: the "
       "share of the rendered person in pieces that nowhere touch the posed body. Frames count from 0 in the "
       "film."},
      {{"Poses", {"figure", "mean", "worst", "frame", "limb", "measured"}, {}}},
      {},
      {}};
  for (const Figure& figure : figures()) {
    const Summary summary = summary_of(figure, frames);
    const bool any = summary.worst_frame >= 0;
    report.tables[0].rows.push_back({figure.title, cell(summary.mean, 4), cell(summary.worst, 4),
                                     any ? std::to_string(summary.worst_frame) : "-",
                                     any ? limb_of(figure, frames[summary.worst_frame]) : "",
                                     fmt::format("{} of {} frames", summary.count, frames.size())});
    Report::Plot plot{figure.title, "frame", "share", {{figure.title, {}}}};
    for (const MotionFrameScore& frame : frames)
      plot.curves[0].values.push_back(figure.value(frame).value_or(NAN));
    report.plots.push_back(plot);
  }
  return report;
}

nlohmann::ordered_json MotionEvaluation::json() const {
  nlohmann::ordered_json all, worst = nlohmann::ordered_json::object(),
                              rows = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < frames.size(); ++i) rows.push_back({{"frame", i}});
  for (const Figure& figure : figures()) {
    const auto add = [&](nlohmann::ordered_json& row, const char* name, const MotionFrameScore& score) {
      const std::optional<double> value = figure.value(score);
      if (!value) return;
      row[name] = *value;
      if (const std::string limb = limb_of(figure, score); !limb.empty()) row["limb"] = limb;
    };
    for (std::size_t i = 0; i < frames.size(); ++i) add(rows[i], figure.name, frames[i]);
    const Summary summary = summary_of(figure, frames);
    if (summary.worst_frame < 0) continue;
    all[figure.name] = summary.mean;
    all["measured_frames"][figure.name] = summary.count;
    worst[figure.name]["frame"] = summary.worst_frame;
    add(worst[figure.name], "value", frames[summary.worst_frame]);
  }
  all["worst"] = worst;
  all["frames"] = rows;
  return all;
}

namespace {

/// The film in its scene, plain and with the posed body's outline.
class OutlinedFilm {
 public:
  OutlinedFilm(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
               const std::filesystem::path& folder)
      : renderer_(device, run, scene, film, "both", false),
        videos_{{"rendered", folder / "rendered.mp4"}, {"outlined", folder / "outlined.mp4"}},
        plain_(videos_[0].file, film_size(film), film.fps),
        outlined_(videos_[1].file, film_size(film), film.fps) {}

  void add(const Shot& shot, const cv::Mat& body) {
    cv::Mat picture = to_picture(renderer_.render(shot)), inside;
    plain_.write(picture);
    cv::erode(body, inside, {});
    picture.setTo(cv::Scalar(0, 255, 0), body & ~inside);
    outlined_.write(picture);
  }
  std::vector<Report::Video> close() {
    plain_.close();
    outlined_.close();
    return videos_;
  }

 private:
  FilmRenderer renderer_;
  std::vector<Report::Video> videos_;
  VideoWriter plain_, outlined_;
};

bool shows_enough(const BodySilhouette& body) { return cv::countNonZero(body.mask) >= least_body_pixels; }

MotionFrameScore frame_score(const cv::Mat& rendered, const BodySilhouette& body) {
  return {silhouette_iou(rendered, body.mask), least_covered_limb(rendered, body),
          detached_share(rendered, body.mask)};
}

}  // namespace

MotionEvaluation evaluate_motion(Device& device, const OpenRun& run, const OpenRun& scene,
                                 const FilmOptions& options, const std::filesystem::path& output,
                                 Progress& progress) {
  const Film film = plan_film(run, scene, options);
  const auto body_of = [&](const Shot& shot) {
    return posed_silhouette(run.model->human()->body().body(), shot.person->pose, shot.person->translation,
                            shot.camera, film.units_per_metre);
  };
  if (std::ranges::none_of(film.shots, [&](const Shot& shot) { return shows_enough(body_of(shot)); }))
    fail("no frame shows {} pixels of the person: choose other --views, another --place or a larger --size",
         least_body_pixels);
  FilmRenderer person(device, run, scene, film, "human", false);
  std::optional<OutlinedFilm> pictures;
  if (!output.empty()) {
    make_folder(output);
    pictures.emplace(device, run, scene, film, output);
  }
  MotionEvaluation evaluation;
  const InterruptGuard guard;
  progress.begin("eval", 0, static_cast<std::int64_t>(film.shots.size()));
  for (const Shot& shot : film.shots) {
    const BodySilhouette body = body_of(shot);
    evaluation.frames.emplace_back();
    if (shows_enough(body)) {
      LayerFrame rendered = person.render(shot);
      const cv::Mat alpha(rendered.height, rendered.width, CV_32FC1, rendered.alpha.data());
      evaluation.frames.back() = frame_score(alpha > 0.5, body);
    }
    if (pictures) pictures->add(shot, body.mask);
    progress.report({.step = static_cast<std::int64_t>(evaluation.frames.size())});
    if (interrupted()) throw Interrupted("stopped while measuring");
  }
  progress.end();
  if (pictures) {
    Report report = evaluation.report();
    report.videos = pictures->close();
    write_report(output, report, evaluation.json());
  }
  return evaluation;
}

}  // namespace vivant
