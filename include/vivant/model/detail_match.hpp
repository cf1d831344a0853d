#pragma once
#include <array>
#include <opencv2/core.hpp>

namespace vivant {

/// The detail of a picture: its bands between Gaussian blurs of 0, 0.5, 1 and 3 pixels, the finest first.
using DetailBands = std::array<cv::Mat, 3>;
/// Of a CV_32FC3 picture.
DetailBands detail_bands(const cv::Mat& picture);

/// How strong each band of a picture is: its mean square over pixels and channels.
class DetailStrength {
 public:
  std::array<double, std::tuple_size_v<DetailBands>> mean_squares = {};

  /// Takes in one more picture, CV_32FC3; all count alike.
  void add(const cv::Mat& picture);
  /// The strength of another picture takes part with this share.
  void mix(const DetailStrength& other, double share);

 private:
  double count_ = 0;
};

/// Multiplies each band of a picture by its gain.
struct DetailTransform {
  std::array<double, std::tuple_size_v<DetailBands>> gains = {1, 1, 1};

  /// From none of it (0) to all (1).
  DetailTransform blended(double amount) const;
  /// Applies it in place to CV_32FC3 and clamps to [0, 1].
  void apply(cv::Mat& picture) const;
};

/// The most by which detail is made stronger: more is noise.
constexpr double largest_detail_gain = 1.6;

/// Brings each band's root mean square from that of `from` to that of `to`, where that is stronger: what
/// fields render is softer than a painting. Gains are at most `largest_detail_gain`.
DetailTransform match_detail(const DetailStrength& from, const DetailStrength& to);

}  // namespace vivant
