#pragma once
#include "jobs/feature_views.hpp"
#include "vivant/nn/vgg19.hpp"

namespace vivant {

/// The statistics of norm(c) over some of the views.
ContentNorm measured_norm(Device& device, const Config& config, const CaptureModel& model, const Vgg19& vgg,
                          const std::vector<FeatureView>& views);

/// A view in a style (CV_8UC3 RGB), or as the decoder shows it unstylised when there is none: CV_32FC3.
cv::Mat stylised_view(Device& device, const Config& config, const CaptureModel& model, const Vgg19& vgg,
                      const FeatureView& view, const cv::Mat& style);

/// Pictures side by side, CV_8UC3.
cv::Mat preview_sheet(const std::vector<cv::Mat>& pictures);

}  // namespace vivant
