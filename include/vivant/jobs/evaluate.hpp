#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vivant/jobs/open_run.hpp"

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

/// How well a run renders pictures that it was not trained on.
struct Evaluation {
  std::vector<FrameScore> frames;
  FrameScore mean;  ///< of the frames
  std::string table() const;
  std::string json() const;
};

/// Renders frames and compares them with their pictures: the held-out frames of the run's own capture, or all
/// frames of `truth`, another capture of the same world and person, when it is given. Whole frames when the
/// run has a person; else the pixels of the mask are left out.
///
/// In the truth an instant of the run's capture (known by the values of its pose) keeps its codes, other
/// poses have the novel codes, and colours do not depend on the view direction, since its views are new.
///
/// Throws Error when pictures are missing, and when the truth shows no body of the person's joints.
Evaluation evaluate(Device& device, const OpenRun& run, const std::filesystem::path& truth,
                    Progress& progress);

}  // namespace vivant
