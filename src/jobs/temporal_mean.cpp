#include "vivant/jobs/temporal_mean.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "vivant/jobs/flow.hpp"
#include "vivant/model/detail_match.hpp"

namespace vivant {
namespace {

constexpr int neighbourhood = 9;   // pixels a side over which colours are compared
constexpr int speck = 5;           // pixels a side: what is hidden and smaller changes nothing around it
constexpr float of_hidden = 1e6f;  // more than any difference of colours

cv::Mat square(int side) { return cv::Mat::ones(side, side, CV_8UC1); }

/// The mean squared difference of the colours at each pixel.
cv::Mat squared_difference(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat result(a.size(), CV_32FC1);
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x) {
      const cv::Vec3f difference = a.at<cv::Vec3f>(y, x) - b.at<cv::Vec3f>(y, x);
      result.at<float>(y, x) = difference.dot(difference) / 3;
    }
  return result;
}

}  // namespace

Correspondence best_flow(const cv::Mat& here, const cv::Mat& there, const std::vector<FlowPair>& flows) {
  Correspondence best;
  cv::Mat least;
  for (const FlowPair& pair : flows) {
    const cv::Mat visible = visible_pixels(pair.forward, pair.backward);
    cv::Mat error;
    cv::boxFilter(squared_difference(here, warped(there, pair.forward)), error, CV_32F,
                  {neighbourhood, neighbourhood});
    error.setTo(of_hidden, visible == 0);
    if (best.flow.empty()) {
      best = {pair.forward.clone(), visible};
      least = error;
      continue;
    }
    const cv::Mat better = error < least;
    pair.forward.copyTo(best.flow, better);
    visible.copyTo(best.visible, better);
    error.copyTo(least, better);
  }
  return best;
}

cv::Mat trust_in(const cv::Mat& here, const cv::Mat& there, const cv::Mat& person,
                 const Correspondence& found) {
  cv::Mat hidden, near_hidden;
  cv::morphologyEx(found.visible == 0, hidden, cv::MORPH_OPEN, square(speck));
  cv::dilate(hidden, near_hidden, square(2 * surroundings + 1));
  if (!person.empty()) near_hidden.setTo(0, person > 0.5);
  cv::Mat trust;
  cv::exp(squared_difference(here, warped(there, found.flow)) / (-2 * colour_scale * colour_scale), trust);
  trust.setTo(0, near_hidden | (found.visible == 0));
  return trust;
}

TemporalMean temporal_mean(const cv::Mat& picture, const std::vector<Neighbour>& neighbours) {
  TemporalMean mean{picture.clone(), cv::Mat(picture.size(), CV_32FC1, cv::Scalar(1))};
  for (const Neighbour& neighbour : neighbours) {
    const cv::Mat seen = warped(neighbour.colours, neighbour.flow, cv::INTER_CUBIC);
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        const float weight = neighbour.trust.at<float>(y, x);
        mean.colours.at<cv::Vec3f>(y, x) += weight * seen.at<cv::Vec3f>(y, x);
        mean.weights.at<float>(y, x) += weight;
      }
  }
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      mean.colours.at<cv::Vec3f>(y, x) *= 1 / mean.weights.at<float>(y, x);
  return mean;
}

cv::Mat with_detail_of(const cv::Mat& picture, const TemporalMean& mean) {
  // Fully where three pictures went into the mean.
  const cv::Mat averaged = mean.weights > 1, share = cv::min(0.5 * (mean.weights - 1), 1);
  cv::Mat shares, added = cv::Mat::zeros(picture.size(), CV_32FC3);
  cv::merge(std::vector<cv::Mat>(3, share), shares);
  const DetailBands bands = detail_bands(mean.colours), aims = detail_bands(picture);
  for (std::size_t i = 0; i < bands.size(); ++i) {
    const double now = cv::norm(bands[i], cv::NORM_L2, averaged),
                 wanted = cv::norm(aims[i], cv::NORM_L2, averaged);
    if (now > 0) added += (std::clamp(wanted / now, 1.0, largest_detail_gain) - 1) * bands[i];
  }
  return mean.colours + added.mul(shares);
}

}  // namespace vivant
