#include "vivant/jobs/temporal_mean.hpp"

#include <opencv2/imgproc.hpp>

#include "vivant/jobs/flow.hpp"

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

cv::Mat temporal_mean(const cv::Mat& picture, const std::vector<Neighbour>& neighbours) {
  cv::Mat sum = picture.clone(), weights(picture.size(), CV_32FC1, cv::Scalar(1));
  for (const Neighbour& neighbour : neighbours) {
    const cv::Mat seen = warped(neighbour.colours, neighbour.flow, cv::INTER_CUBIC);
    for (int y = 0; y < sum.rows; ++y)
      for (int x = 0; x < sum.cols; ++x) {
        const float weight = neighbour.trust.at<float>(y, x);
        sum.at<cv::Vec3f>(y, x) += weight * seen.at<cv::Vec3f>(y, x);
        weights.at<float>(y, x) += weight;
      }
  }
  for (int y = 0; y < sum.rows; ++y)
    for (int x = 0; x < sum.cols; ++x) sum.at<cv::Vec3f>(y, x) *= 1 / weights.at<float>(y, x);
  return sum;
}

cv::Mat with_detail_of(const cv::Mat& picture, const cv::Mat& mean) {
  cv::Mat result = mean.clone();
  for (const double scale : {3.0, 1.0, 0.5}) {
    cv::Mat coarse, coarse_picture;
    cv::GaussianBlur(result, coarse, {}, scale);
    cv::GaussianBlur(picture, coarse_picture, {}, scale);
    const double now = cv::norm(result, coarse), aim = cv::norm(picture, coarse_picture);
    const double gain = now > 0 ? std::min(most_detail, aim / now) : 1;
    result = coarse + gain * (result - coarse);
  }
  return result;
}

}  // namespace vivant
