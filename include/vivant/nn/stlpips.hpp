#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <utility>

#include "vivant/graph/executor.hpp"
#include "vivant/io/tensor_file.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// ST-LPIPS, the shift-tolerant learned perceptual distance of two pictures (Ghildyal and Liu 2022, AlexNet
/// form). Its numbers are not those of the original LPIPS. 0 for equal pictures.
class StLpips {
 public:
  static constexpr int smallest_side = 32;

  /// Reads a weights file in the layout of assets/README.md. Throws Error for a file that does not fit.
  StLpips(Device& device, const std::filesystem::path& file);
  /// The file that comes with the program.
  explicit StLpips(Device& device);
  ~StLpips();

  /// Distance of two CV_8UC3 RGB pictures of one size. With a mask (CV_8UC1) over its pixels >= 128 alone:
  /// the others are made equal, and each layer's differences are averaged with the mask, reduced to the
  /// layer's size, as weights. Throws Error for different sizes, sides below `smallest_side` and an empty
  /// mask.
  double distance(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask = {});

 private:
  struct Network;
  Network& network(cv::Size size);

  Device& device_;
  TensorFile weights_;
  std::map<std::pair<int, int>, std::unique_ptr<Network>> networks_;  // by height and width
};

}  // namespace vivant
