#include "vivant/jobs/silhouette_scores.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace vivant {

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
  cv::Mat labels;
  const int count = cv::connectedComponents(rendered, labels);
  std::vector<char> on_body(count, 0);
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x)
      if (body.at<std::uint8_t>(y, x) != 0) on_body[labels.at<int>(y, x)] = 1;
  int detached = 0;
  for (int label = 1; label < count; ++label)  // 0 is what is not in the silhouette
    if (on_body[label] == 0) detached += cv::countNonZero(labels == label);
  return static_cast<double>(detached) / std::max(1, cv::countNonZero(rendered));
}

}  // namespace vivant
