#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vivant/jobs/progress.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// Peak signal-to-noise ratio in dB of two CV_8UC3 pictures; with a mask (CV_8UC1) over its pixels >= 128
/// alone.
double psnr(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask = {});
/// Structural similarity of the luma (Wang et al. 2004: Gaussian window 11, sigma 1.5, K1 0.01, K2 0.03).
double ssim(const cv::Mat& a, const cv::Mat& b);

struct FrameScore {
  std::string frame;
  double psnr = 0, ssim = 0;
  std::optional<double> person_psnr, silhouette_iou;  ///< over the mask's pixels; of alpha > 1/2 and the mask
};

/// How well a run renders the held-out frames of its capture.
struct Evaluation {
  std::vector<FrameScore> frames;
  FrameScore mean;  ///< of the frames
  std::string table() const;
  std::string json() const;
};

/// Renders every held-out frame and compares it with its picture, which must still be where the capture was.
/// Whole frames when the run has a person; else the pixels of the mask are left out.
Evaluation evaluate(Device& device, const std::filesystem::path& run, Progress& progress);

}  // namespace vivant
