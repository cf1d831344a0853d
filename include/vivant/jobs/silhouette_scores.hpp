#pragma once
#include <opencv2/core.hpp>
#include <optional>

#include "vivant/data/body_silhouette.hpp"

namespace vivant {

// How well a silhouette, CV_8UC1 of 0 and 255, agrees with another one of its size.

/// Intersection over union; 0 when both are empty.
double silhouette_iou(const cv::Mat& a, const cv::Mat& b);

/// The share of a limb's visible pixels that a silhouette covers.
struct LimbCover {
  const char* limb;  ///< its name
  double share = 0;
};
/// A limb that shows fewer pixels says nothing: its border is most of it.
constexpr int least_limb_pixels = 30;
/// The limb of the body that a rendered silhouette covers least; none when no limb shows enough pixels.
std::optional<LimbCover> least_covered_limb(const cv::Mat& rendered, const BodySilhouette& body);

/// The share of a rendered silhouette in pieces (pixels that touch at a corner are joined) of which no pixel
/// is on the body: the picture's border may cut the body itself into pieces.
double detached_share(const cv::Mat& rendered, const cv::Mat& body);

}  // namespace vivant
