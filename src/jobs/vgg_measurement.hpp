#pragma once
#include <opencv2/core.hpp>

#include "vivant/graph/executor.hpp"
#include "vivant/model/style_losses.hpp"

namespace vivant {

/// Measures how VGG-19's layers vary over square pictures.
class VggMeasurement {
 public:
  VggMeasurement(Device& device, const Vgg19& vgg, int side);

  /// Takes in a picture, CV_32FC3 RGB in [0, 1] of side x side; returns its relu3_1 [side / 4, side / 4,
  /// 256].
  std::vector<float> add(const cv::Mat& picture);

  /// Of the channels of a layer, 0 for relu1_1 to 4 for relu5_1, over all pictures.
  std::vector<double> variance(int layer) const;
  ChannelScales scales() const;

 private:
  struct Moments {
    std::vector<double> sum, square;
  };
  Graph graph_;
  Value picture_;
  Values outputs_;
  std::unique_ptr<Executor> executor_;
  std::array<Moments, 5> moments_;
  int count_ = 0;
};

}  // namespace vivant
