#include "vivant/jobs/evaluate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "vivant/io/atomic_file.hpp"
#include "vivant/io/video.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/picture_scores.hpp"
#include "vivant/jobs/pose_fit.hpp"
#include "vivant/jobs/silhouette_scores.hpp"
#include "vivant/model/composite_renderer.hpp"
#include "vivant/nn/stlpips.hpp"

namespace vivant {

namespace {

RegionScore region_score(StLpips& perceptual, const cv::Mat& rendered, const cv::Mat& truth,
                         const cv::Mat& region) {
  RegionScore score{psnr(rendered, truth, region), ssim(rendered, truth, region), {}};
  if (std::min(truth.rows, truth.cols) >= StLpips::smallest_side)
    score.stlpips = perceptual.distance(truth, rendered, region);
  return score;
}

/// What is rendered of a held-out frame and what it is compared with. `person`: its alpha; `body`: the posed
/// body's silhouette; both empty without a person.
FrameScore frame_score(StLpips& perceptual, const CaptureFrame& frame, const cv::Mat& truth,
                       const cv::Mat& mask, const cv::Mat& rendered, const cv::Mat& person,
                       const cv::Mat& body) {
  const cv::Mat inside = mask >= 128, outside = ~inside;
  if (person.empty()) return {frame.name, region_score(perceptual, rendered, truth, outside), {}, {}, {}, {}};
  FrameScore score{frame.name, region_score(perceptual, rendered, truth, {}), {}, {}, {}, {}};
  if (cv::countNonZero(inside) == 0) return score;
  score.person = region_score(perceptual, rendered, truth, inside);
  if (cv::countNonZero(outside) > 0) score.background = region_score(perceptual, rendered, truth, outside);
  score.silhouette_iou = silhouette_iou(person > 0.5, inside);
  score.body_iou = silhouette_iou(body, inside);
  return score;
}

/// The mean of what the frames have of a number.
template <typename Number>
std::optional<double> mean_of(const std::vector<FrameScore>& frames, Number number) {
  double sum = 0;
  int count = 0;
  for (const FrameScore& frame : frames)
    if (const std::optional<double> value = number(frame)) {
      sum += *value;
      ++count;
    }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

/// The mean of a region, which `region` gives as a pointer that may be null.
template <typename Region>
std::optional<RegionScore> mean_region(const std::vector<FrameScore>& frames, Region region) {
  const auto mean = [&](auto number) {
    return mean_of(frames, [&](const FrameScore& frame) -> std::optional<double> {
      const RegionScore* score = region(frame);
      return score ? number(*score) : std::nullopt;
    });
  };
  const auto psnr = mean([](const RegionScore&score) { return std::optional(score.psnr); }),
             ssim = mean([](const RegionScore&score) { return std::optional(score.ssim); }),
             stlpips = mean([](const RegionScore&score) { return score.stlpips; });
  if (!psnr) return std::nullopt;
  return RegionScore{*psnr, *ssim, stlpips};
}

FrameScore mean_score(const std::vector<FrameScore>& frames) {
  const auto pointer = [](const std::optional<RegionScore>& score) { return score ? &*score : nullptr; };
  return {"mean",
          mean_region(frames, [](const FrameScore& frame) { return &frame.full; }).value(),
          mean_region(frames, [&](const FrameScore& frame) { return pointer(frame.person); }),
          mean_region(frames, [&](const FrameScore& frame) { return pointer(frame.background); }),
          mean_of(frames, [](const FrameScore& frame) { return frame.silhouette_iou; }),
          mean_of(frames, [](const FrameScore& frame) { return frame.body_iou; })};
}

/// A score's columns: name in JSON, title, digits, value.
struct Column {
  const char *name, *title;
  int digits;
  std::optional<double> value;
};

std::vector<Column> columns_of(const FrameScore& score) {
  std::vector<Column> columns;
  const auto add = [&](std::array<const char*, 3> names, std::array<const char*, 3> titles,
                       const std::optional<RegionScore>& region) {
    const auto value = [&](auto number) { return region ? std::optional<double>(number) : std::nullopt; };
    const RegionScore here = region.value_or(RegionScore{});
    columns.push_back({names[0], titles[0], 2, value(here.psnr)});
    columns.push_back({names[1], titles[1], 4, value(here.ssim)});
    columns.push_back({names[2], titles[2], 4, here.stlpips});
  };
  add({"psnr", "ssim", "stlpips"}, {"PSNR", "SSIM", "ST-LPIPS"}, score.full);
  add({"person_psnr", "person_ssim", "person_stlpips"}, {"person", "SSIM", "ST-LPIPS"}, score.person);
  add({"background_psnr", "background_ssim", "background_stlpips"}, {"backgr.", "SSIM", "ST-LPIPS"},
      score.background);
  columns.push_back({"silhouette_iou", "IoU", 3, score.silhouette_iou});
  columns.push_back({"body_iou", "body's IoU", 3, score.body_iou});
  return columns;
}

nlohmann::ordered_json json_of(const FrameScore& score) {
  nlohmann::ordered_json json;
  for (const Column& column : columns_of(score))
    if (column.value) json[column.name] = *column.value;
  return json;
}

}  // namespace

Report Evaluation::report() const {
  Report report{
      "Rendered pictures and true ones",
      {"PSNR in dB, SSIM of the luma, ST-LPIPS (the shift-tolerant metric, not LPIPS): of the "
       "whole frame (of a "
       "run without a person: outside of the mask), inside of the person's mask and outside of it. "
       "IoU: of the rendered silhouette and the mask; body's IoU: of the bare body in the pose that "
       "was given and the mask, below 1 by clothes, hair, what is held and the pose's error."},
      {{"Frames", {"frame"}, {}}},
      {},
      {}};
  if (fitted_steps > 0)
    report.notes.push_back(fmt::format(
        "The person's corrections were fitted to these very pictures and masks in {} steps, the fields as "
        "they were: its figures are not those of held-out frames.",
        fitted_steps));
  Report::Table& table = report.tables[0];
  for (const Column& column : columns_of(mean)) table.header.emplace_back(column.title);
  const auto add = [&](const FrameScore& score) {
    table.rows.push_back({score.frame});
    for (const Column& column : columns_of(score))
      table.rows.back().push_back(cell(column.value.value_or(NAN), column.digits));
  };
  for (const FrameScore& score : frames) add(score);
  add(mean);
  for (const auto& [title, first] : {std::pair("PSNR", 0), std::pair("SSIM", 1), std::pair("ST-LPIPS", 2)}) {
    Report::Plot plot{
        title, "frame", first == 0 ? "dB" : title, {{"frame", {}}, {"person", {}}, {"background", {}}}};
    for (const FrameScore& score : frames)
      for (int region = 0; region < 3; ++region)
        plot.curves[region].values.push_back(columns_of(score)[3 * region + first].value.value_or(NAN));
    report.plots.push_back(plot);
  }
  return report;
}

void write_evaluation(const std::filesystem::path& folder, const Evaluation& evaluation) {
  make_folder(folder);
  Report report = evaluation.report();
  for (const auto& [name, pictures] :
       {std::pair("truth", &evaluation.truth), std::pair("rendered", &evaluation.rendered)}) {
    const std::filesystem::path file = folder / (std::string(name) + ".mp4");
    VideoWriter video(file, pictures->front().size(), evaluation.fps);
    for (const cv::Mat& picture : *pictures) video.write(picture);
    video.close();
    report.videos.push_back({name, file});
  }
  write_report(folder, report, evaluation.json());
}

nlohmann::ordered_json Evaluation::json() const {
  nlohmann::ordered_json all = json_of(mean), rows = nlohmann::ordered_json::array();
  if (fitted_steps > 0) all["fitted_steps"] = fitted_steps;
  for (const FrameScore& score : frames) {
    rows.push_back(json_of(score));
    rows.back()["frame"] = score.frame;
  }
  all["frames"] = rows;
  return all;
}

namespace {

/// What the person does in a frame of the truth: the same as at the captured instant that has its pose, else
/// something new.
PersonState state_of(const OpenRun& run, const Capture& truth, int frame) {
  const CaptureFrame& shown = truth.frames[frame];
  const HumanModel& human = *run.model->human();
  if (!truth.human || shown.body_frame < 0)
    fail("{}: the frame {} shows no person", truth.source.string(), shown.name);
  const Motion &poses = truth.human->poses, &captured = run.given.human->poses;
  for (int i = 0; i < static_cast<int>(run.given.frames.size()); ++i) {
    const int row = run.given.frames[i].body_frame;
    if (row >= 0 && captured.pose[row] == poses.pose[shown.body_frame] &&
        captured.translation[row] == poses.translation[shown.body_frame])
      return captured_state(human, run.capture, i);
  }
  check_motion(poses, human.body().body().joint_count(), truth.source.string());
  return novel_state(poses, shown.body_frame, novel_codes(run.config, human));
}

}  // namespace

Evaluation evaluate(Device& device, const OpenRun& run, const EvaluationOptions& options,
                    Progress& progress) {
  const InterruptGuard guard;
  const bool own = options.truth.empty();
  if (!own && options.fit_pose_steps > 0)
    throw UsageError("poses are fitted to held-out frames of the run's own capture, not to another truth");
  const Capture truth = own ? run.capture : load_capture(options.truth);
  const std::vector<int> frames = own ? truth.held_out_frames() : truth.all_frames();
  if (frames.empty()) fail("{}: the capture holds out no frames to compare with", truth.source.string());
  const HumanModel* human = run.model->human();
  std::optional<SceneRenderer> scene;
  std::optional<CompositeRenderer> both;
  if (human)
    both.emplace(device, run.model->scene(), *human, human_renderer_options(run.config, own));
  else
    scene.emplace(device, run.model->scene(), SceneRenderer::Options{});
  std::vector<PersonState> states;
  if (human)
    for (const int index : frames)
      states.push_back(own ? captured_state(*human, truth, index) : state_of(run, truth, index));
  if (options.fit_pose_steps > 0) {
    const std::vector<HumanModel::CodeRow> codes =
        fit_held_out_codes(device, run, options.fit_pose_steps, progress);
    for (std::size_t i = 0; i < codes.size(); ++i) states.at(i).codes = codes[i];
  }
  StLpips perceptual(device);
  Evaluation evaluation;
  evaluation.fps = truth.fps;
  evaluation.fitted_steps = options.fit_pose_steps;
  progress.begin("eval", 0, static_cast<std::int64_t>(frames.size()));
  for (const int index : frames) {
    const CaptureFrame& frame = truth.frames[index];
    CompositeRenderer::View view;
    cv::Mat body;
    if (human) {
      const PersonState& state = states[evaluation.frames.size()];
      view = both->render(frame.camera, state);
      body = posed_silhouette(human->body().body(), state.pose, state.translation, frame.camera).mask;
    } else {
      view.picture = scene->render(frame.camera);
    }
    evaluation.truth.push_back(truth.taken_image(index));
    frame.exposure.apply(view.picture.pixels);
    evaluation.rendered.push_back(view.picture.rgb8());
    evaluation.frames.push_back(frame_score(perceptual, frame, evaluation.truth.back(), truth.mask(index),
                                            evaluation.rendered.back(), view.person, body));
    progress.report({.step = static_cast<std::int64_t>(evaluation.frames.size())});
    if (interrupted()) throw Interrupted("stopped while comparing");
  }
  evaluation.mean = mean_score(evaluation.frames);
  if (options.fit_pose_steps > 0) evaluation.mean.frame = "mean, poses fitted to these pictures";
  progress.end();
  return evaluation;
}

}  // namespace vivant
