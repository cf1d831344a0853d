#include "vivant/jobs/picture_scores.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vivant/jobs/psnr.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

/// Mean squared difference of the colours, of 1.
double squared_error(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
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
  return squares / static_cast<double>(count);
}

}  // namespace

double psnr(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  return psnr_of(squared_error(a, b, mask));
}

double rmse(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  return std::sqrt(squared_error(a, b, mask));
}

double ssim(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
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
  if (mask.empty()) return cv::mean(ratio)[0];
  const cv::Mat inside = mask >= 128;
  if (cv::countNonZero(inside) == 0) fail("ssim: no pixel to compare");
  return cv::mean(ratio, inside)[0];
}

}  // namespace vivant
