#include "vivant/jobs/evaluate.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "vivant/jobs/psnr.hpp"
#include "vivant/model/composite_renderer.hpp"

namespace vivant {

double psnr(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  double squares = 0;
  std::int64_t count = 0;
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x) {
      if (!mask.empty() && mask.at<std::uint8_t>(y, x) < 128) continue;
      const cv::Vec3b &p = a.at<cv::Vec3b>(y, x), &q = b.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) squares += std::pow((p[c] - q[c]) / 255.0, 2);
      count += 3;
    }
  if (count == 0) fail("psnr: no pixel to compare");
  return psnr_of(squares / static_cast<double>(count));
}

double ssim(const cv::Mat& a, const cv::Mat& b) {
  const auto luma = [](const cv::Mat& rgb) {
    cv::Mat gray;
    cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
    gray.convertTo(gray, CV_64F);
    return gray;
  };
  const auto blur = [](const cv::Mat& x) {
    cv::Mat out;
    cv::GaussianBlur(x, out, {11, 11}, 1.5);
    return out;
  };
  const cv::Mat x = luma(a), y = luma(b), mx = blur(x), my = blur(y);
  const cv::Mat vx = blur(x.mul(x)) - mx.mul(mx), vy = blur(y.mul(y)) - my.mul(my),
                cov = blur(x.mul(y)) - mx.mul(my);
  const double c1 = std::pow(0.01 * 255, 2), c2 = std::pow(0.03 * 255, 2);
  const cv::Mat above = (2 * mx.mul(my) + c1).mul(2 * cov + c2);
  const cv::Mat below = (mx.mul(mx) + my.mul(my) + c1).mul(vx + vy + c2);
  cv::Mat ratio;
  cv::divide(above, below, ratio);
  return cv::mean(ratio)[0];
}

namespace {

/// Intersection over union of two silhouettes.
double overlap(const cv::Mat& a, const cv::Mat& b) {
  return static_cast<double>(cv::countNonZero(a & b)) / std::max(1, cv::countNonZero(a | b));
}

/// What is rendered of a held-out frame and what it is compared with.
FrameScore score(const CaptureFrame& frame, const cv::Mat& truth, const cv::Mat& mask,
                 const cv::Mat& rendered, const cv::Mat& person) {
  FrameScore score{frame.name, 0, ssim(rendered, truth), {}, {}};
  const cv::Mat on_person = mask >= 128;
  score.psnr = person.empty() ? psnr(rendered, truth, 255 - mask) : psnr(rendered, truth);
  if (person.empty() || cv::countNonZero(on_person) == 0) return score;
  score.person_psnr = psnr(rendered, truth, on_person);
  score.silhouette_iou = overlap(person > 0.5, on_person);
  return score;
}

/// The mean of what the frames have of a score.
std::optional<double> mean_of(const std::vector<FrameScore>& frames,
                              std::optional<double> FrameScore::*member) {
  double sum = 0;
  int count = 0;
  for (const FrameScore& frame : frames)
    if (frame.*member) {
      sum += *(frame.*member);
      ++count;
    }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

std::string cell(const std::optional<double>& number, int digits) {
  return number ? fmt::format("{:>8.{}f}", *number, digits) : fmt::format("{:>8}", "-");
}

std::string row(const std::string& name, const FrameScore& score) {
  return fmt::format("{:<32} {:>8.2f} {:>8.4f} {} {}\n", name, score.psnr, score.ssim,
                     cell(score.person_psnr, 2), cell(score.silhouette_iou, 3));
}

nlohmann::json json_of(const FrameScore& score) {
  nlohmann::json json = {{"psnr", score.psnr}, {"ssim", score.ssim}};
  if (score.person_psnr) json["person_psnr"] = *score.person_psnr;
  if (score.silhouette_iou) json["silhouette_iou"] = *score.silhouette_iou;
  return json;
}

}  // namespace

std::string Evaluation::table() const {
  std::string text =
      fmt::format("{:<32} {:>8} {:>8} {:>8} {:>8}\n", "frame", "PSNR", "SSIM", "person", "IoU");
  for (const FrameScore& score : frames) text += row(score.frame, score);
  return text + row("mean", mean);
}

std::string Evaluation::json() const {
  nlohmann::json rows = nlohmann::json::array();
  for (const FrameScore& score : frames) {
    rows.push_back(json_of(score));
    rows.back()["frame"] = score.frame;
  }
  nlohmann::json all = json_of(mean);
  all["frames"] = rows;
  return all.dump(1);
}

namespace {

/// What the person does in a frame of the truth: the same as at the captured instant that has its pose, else
/// something new.
PersonState state_of(const OpenRun& run, const Capture& truth, int frame) {
  const CaptureFrame& shown = truth.frames[frame];
  const HumanModel& human = *run.model->human();
  if (!truth.human || shown.body_frame < 0)
    fail("{}: the frame {} shows no person", truth.source.string(), shown.name);
  const Motion &poses = truth.human->poses, &captured = run.capture.human->poses;
  for (int i = 0; i < static_cast<int>(run.capture.frames.size()); ++i) {
    const int row = run.capture.frames[i].body_frame;
    if (row >= 0 && captured.pose[row] == poses.pose[shown.body_frame] &&
        captured.translation[row] == poses.translation[shown.body_frame])
      return captured_state(human, run.capture, i);
  }
  check_motion(poses, human.body().body().joint_count(), truth.source.string());
  return novel_state(poses, shown.body_frame, novel_codes(run.config, human));
}

std::vector<int> all_frames(const Capture& capture) {
  std::vector<int> frames(capture.frames.size());
  std::iota(frames.begin(), frames.end(), 0);
  return frames;
}

}  // namespace

Evaluation evaluate(Device& device, const OpenRun& run, const std::filesystem::path& path,
                    Progress& progress) {
  const bool own = path.empty();
  const Capture truth = own ? run.capture : load_capture(path);
  const std::vector<int> frames = own ? truth.held_out_frames() : all_frames(truth);
  if (frames.empty()) fail("{}: the capture holds out no frames to compare with", truth.source.string());
  const HumanModel* human = run.model->human();
  std::optional<SceneRenderer> scene;
  std::optional<CompositeRenderer> both;
  if (human)
    both.emplace(device, run.model->scene(), *human, human_renderer_options(run.config, own));
  else
    scene.emplace(device, run.model->scene(), SceneRenderer::Options{});
  Evaluation evaluation;
  progress.begin("eval", 0, static_cast<std::int64_t>(frames.size()));
  for (const int index : frames) {
    const CaptureFrame& frame = truth.frames[index];
    CompositeRenderer::View view;
    if (human)
      view = both->render(frame.camera,
                          own ? captured_state(*human, truth, index) : state_of(run, truth, index));
    else
      view.picture = scene->render(frame.camera);
    evaluation.frames.push_back(
        score(frame, truth.image(index), truth.mask(index), view.picture.rgb8(), view.person));
    evaluation.mean.psnr += evaluation.frames.back().psnr / static_cast<double>(frames.size());
    evaluation.mean.ssim += evaluation.frames.back().ssim / static_cast<double>(frames.size());
    progress.report({.step = static_cast<std::int64_t>(evaluation.frames.size())});
  }
  evaluation.mean.person_psnr = mean_of(evaluation.frames, &FrameScore::person_psnr);
  evaluation.mean.silhouette_iou = mean_of(evaluation.frames, &FrameScore::silhouette_iou);
  progress.end();
  return evaluation;
}

}  // namespace vivant
