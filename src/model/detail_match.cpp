#include "vivant/model/detail_match.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vivant {

DetailBands detail_bands(const cv::Mat& picture) {
  constexpr std::array scales = {0.5, 1.0, 3.0};
  DetailBands bands;
  cv::Mat finer = picture;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    cv::Mat coarser;
    cv::GaussianBlur(picture, coarser, {}, scales[i]);
    bands[i] = finer - coarser;
    finer = coarser;
  }
  return bands;
}

void DetailStrength::add(const cv::Mat& picture) {
  const DetailBands bands = detail_bands(picture);
  ++count_;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    const double square = std::pow(cv::norm(bands[i]), 2) / static_cast<double>(3 * picture.total());
    mean_squares[i] += (square - mean_squares[i]) / count_;
  }
}

void DetailStrength::mix(const DetailStrength& other, double share) {
  for (std::size_t i = 0; i < mean_squares.size(); ++i) mean_squares[i] += share * other.mean_squares[i];
}

DetailTransform DetailTransform::blended(double amount) const {
  DetailTransform result;
  for (std::size_t i = 0; i < gains.size(); ++i) result.gains[i] = 1 + amount * (gains[i] - 1);
  return result;
}

void DetailTransform::apply(cv::Mat& picture) const {
  if (gains != DetailTransform{}.gains) {
    const DetailBands bands = detail_bands(picture);
    for (std::size_t i = 0; i < bands.size(); ++i) picture += (gains[i] - 1) * bands[i];
  }
  cv::max(picture, 0.0, picture);
  cv::min(picture, 1.0, picture);
}

DetailTransform match_detail(const DetailStrength& from, const DetailStrength& to) {
  DetailTransform transform;
  for (std::size_t i = 0; i < transform.gains.size(); ++i)
    if (from.mean_squares[i] > 0)
      transform.gains[i] =
          std::clamp(std::sqrt(to.mean_squares[i] / from.mean_squares[i]), 1.0, largest_detail_gain);
  return transform;
}

}  // namespace vivant
