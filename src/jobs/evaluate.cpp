#include "vivant/jobs/evaluate.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "vivant/jobs/open_run.hpp"
#include "vivant/model/view_renderer.hpp"

namespace vivant {

double psnr(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  double squares = 0;
  std::int64_t count = 0;
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x) {
      if (!mask.empty() && mask.at<std::uint8_t>(y, x) < 128) continue;
      const cv::Vec3b p = a.at<cv::Vec3b>(y, x), q = b.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) squares += std::pow((p[c] - q[c]) / 255.0, 2);
      count += 3;
    }
  if (count == 0) fail("psnr: no pixel to compare");
  return -10 * std::log10(std::max(1e-12, squares / static_cast<double>(count)));
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

std::string Evaluation::table() const {
  std::string text = fmt::format("{:<32} {:>8} {:>8}\n", "held-out frame", "PSNR", "SSIM");
  for (const FrameScore& score : frames)
    text += fmt::format("{:<32} {:>8.2f} {:>8.4f}\n", score.frame, score.psnr, score.ssim);
  return text + fmt::format("{:<32} {:>8.2f} {:>8.4f}\n", "mean", mean_psnr, mean_ssim);
}

std::string Evaluation::json() const {
  nlohmann::json rows = nlohmann::json::array();
  for (const FrameScore& score : frames)
    rows.push_back({{"frame", score.frame}, {"psnr", score.psnr}, {"ssim", score.ssim}});
  return nlohmann::json{{"frames", rows}, {"psnr", mean_psnr}, {"ssim", mean_ssim}}.dump(1);
}

Evaluation evaluate(Device& device, const std::filesystem::path& path, Progress& progress) {
  const OpenRun run = open_run(device, path, progress);
  const std::vector<int> held_out = run.capture.held_out_frames();
  if (held_out.empty()) fail("{}: the capture holds out no frames to compare with", path.string());
  SceneRenderer renderer(device, run.model->scene(), {});
  Evaluation evaluation;
  progress.begin("eval", 0, static_cast<std::int64_t>(held_out.size()));
  for (const int index : held_out) {
    const CaptureFrame& frame = run.capture.frames[index];
    const cv::Mat truth = run.capture.image(index);
    const cv::Mat mask = run.capture.mask(index);
    const cv::Mat rendered = renderer.render(frame.camera).rgb8();
    FrameScore score{frame.name, psnr(rendered, truth, 255 - mask), ssim(rendered, truth)};
    evaluation.mean_psnr += score.psnr / static_cast<double>(held_out.size());
    evaluation.mean_ssim += score.ssim / static_cast<double>(held_out.size());
    evaluation.frames.push_back(std::move(score));
    progress.report({.step = static_cast<std::int64_t>(evaluation.frames.size())});
  }
  progress.end();
  return evaluation;
}

}  // namespace vivant
