#include "vivant/jobs/silhouette_scores.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace vivant {
namespace {

/// The share of a silhouette outside of its largest connected component; 0 of nothing.
double share_outside_of_largest(const cv::Mat& silhouette) {
  cv::Mat labels, statistics, centres;
  const int count = cv::connectedComponentsWithStats(silhouette, labels, statistics, centres);
  int sum = 0, largest = 0;
  for (int label = 1; label < count; ++label) {  // 0 is what is not in the silhouette
    const int area = statistics.at<int>(label, cv::CC_STAT_AREA);
    sum += area;
    largest = std::max(largest, area);
  }
  return sum > 0 ? 1 - static_cast<double>(largest) / sum : 0;
}

}  // namespace

double silhouette_iou(const cv::Mat& a, const cv::Mat& b) {
  return static_cast<double>(cv::countNonZero(a & b)) / std::max(1, cv::countNonZero(a | b));
}

std::optional<LimbCover> least_covered_limb(const cv::Mat& rendered, const BodySilhouette& body) {
  std::optional<LimbCover> least;
  for (std::size_t i = 0; i < limbs.size(); ++i) {
    const cv::Mat visible = body.limb == static_cast<int>(i);
    const int pixels = cv::countNonZero(visible);
    if (pixels < least_limb_pixels) continue;
    const double share = static_cast<double>(cv::countNonZero(visible & rendered)) / pixels;
    if (!least || share < least->share) least = LimbCover{limbs[i].name, share};
  }
  return least;
}

double detached_share(const cv::Mat& rendered, const cv::Mat& body) {
  return std::max(0.0, share_outside_of_largest(rendered) - share_outside_of_largest(body));
}

}  // namespace vivant
