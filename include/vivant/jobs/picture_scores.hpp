#pragma once
#include <opencv2/core.hpp>

namespace vivant {

// How alike two CV_8UC3 RGB pictures of one size are; with a mask (CV_8UC1) over its pixels >= 128 alone.
// Each throws Error when there is no pixel to compare. The perceptual distance is StLpips (nn/stlpips.hpp).

/// Peak signal-to-noise ratio in dB; 120 for equal pictures.
double psnr(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask = {});
/// Structural similarity of the luma (Wang et al. 2004: Gaussian window 11, sigma 1.5, K1 0.01, K2 0.03).
double ssim(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask = {});
/// Root of the mean squared difference of the colours, of 1.
double rmse(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask = {});

}  // namespace vivant
