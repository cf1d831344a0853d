#pragma once
#include <opencv2/core.hpp>
#include <vector>

namespace vivant {

/// A way to find the points of one picture in another: the flow there and the flow back, see flow.hpp.
struct FlowPair {
  cv::Mat forward, backward;
};

/// Where each pixel of one picture is in another (CV_32FC2), and where that is known (CV_8UC1, 0 or 255).
struct Correspondence {
  cv::Mat flow, visible;
};

/// For each pixel the flow that finds the colours of its neighbourhood again best, among those by which it is
/// visible (visible_pixels). `here` and `there` are CV_32FC3.
Correspondence best_flow(const cv::Mat& here, const cv::Mat& there, const std::vector<FlowPair>& flows);

/// How much of what is found in `there` is the same surface point in the same surroundings, which the
/// stylizer paints with it, CV_32FC1. 0 where nothing is visible, and up to `surroundings` pixels away from
/// where more than a speck is hidden; not so on the person, because what is painted on limbs moves with them.
/// Elsewhere 1 for equal colours, falling with their difference as a Gaussian of `colour_scale`. `here` and
/// `there` are unstylised, CV_32FC3; `person` is the person's share of each pixel here, empty without a
/// person.
cv::Mat trust_in(const cv::Mat& here, const cv::Mat& there, const cv::Mat& person,
                 const Correspondence& found);
constexpr int surroundings = 8;
constexpr float colour_scale = 0.05f;

/// A picture next to another one in time.
struct Neighbour {
  cv::Mat colours;  ///< CV_32FC3
  cv::Mat flow;     ///< CV_32FC2, from the picture to the neighbour
  cv::Mat trust;    ///< CV_32FC1 in 0..1: the weight of what the flow finds
};

/// The weighted mean of a picture (CV_32FC3, weight 1) and of its neighbours seen from it, bicubic.
struct TemporalMean {
  cv::Mat colours;  ///< CV_32FC3
  cv::Mat weights;  ///< CV_32FC1, 1 where it is the picture itself
};
TemporalMean temporal_mean(const cv::Mat& picture, const std::vector<Neighbour>& neighbours);

/// The mean (CV_32FC3), its detail as strong as that of the picture alone where it is a mean of several: each
/// band (detail_match.hpp) is multiplied by one number, at most `largest_detail_gain`, that makes its rms
/// there the same.
cv::Mat with_detail_of(const cv::Mat& picture, const TemporalMean& mean);

}  // namespace vivant
