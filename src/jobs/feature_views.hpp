#pragma once
#include <opencv2/core.hpp>
#include <vector>

#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/progress.hpp"

namespace vivant {

/// What the fields render from one camera, kept on the host: while the fields are frozen, the stages that
/// follow need no more of them.
struct FeatureView {
  int frame = -1;  ///< of the capture; -1 for a view that no picture shows
  cv::Mat rgb;     ///< CV_32FC3 in [0, 1], sides are multiples of 4: the outermost pixels go on
  cv::Mat hidden;  ///< CV_32FC(129 or 258) at a quarter of the size, see composite_output
  Camera camera;   ///< of `hidden`
  std::optional<PersonState> person;
};

/// At most `limit` training frames, spread evenly.
std::vector<FeatureView> training_views(Device& device, const Config& config, const Capture& capture,
                                        const CaptureModel& model, std::int64_t limit, Progress& progress);

/// `count` views that no picture shows: an orbit, and, with a person, training cameras with the pose of
/// another instant, rendered as novel poses are.
std::vector<FeatureView> novel_views(Device& device, const Config& config, const Capture& capture,
                                     const CaptureModel& model, std::int64_t count, Progress& progress);

/// The hidden units of a training view as they are now.
cv::Mat hidden_now(Device& device, const Config& config, const CaptureModel& model, const FeatureView& view);

/// A CV_32FC3 picture in [0, 1] whose sides are multiples of 4, as FeatureView::rgb.
cv::Mat padded_picture(const cv::Mat& rgb);

/// F_c of hidden units [h, w, 129 or 258]: [h, w, 256].
Value rendered_features(Graph& graph, const CaptureModel& model, Value hidden);
/// Channels of FeatureView::hidden.
std::int64_t hidden_channels(const CaptureModel& model);

}  // namespace vivant
