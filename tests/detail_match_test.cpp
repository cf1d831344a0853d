#include "vivant/model/detail_match.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

using namespace vivant;

namespace {

cv::Mat noise(double deviation, int seed) {
  cv::Mat picture(60, 80, CV_32FC3);
  cv::RNG random(seed);
  random.fill(picture, cv::RNG::NORMAL, 0.5, deviation);
  return picture;
}

cv::Mat soft(const cv::Mat& picture, double scale) {
  cv::Mat result;
  cv::GaussianBlur(picture, result, {}, scale);
  return result;
}

DetailStrength strength_of(const cv::Mat& picture) {
  DetailStrength strength;
  strength.add(picture);
  return strength;
}

}  // namespace

TEST_CASE("detail match: bands and what is left make the picture; a plain picture has none") {
  const cv::Mat picture = noise(0.1, 1);
  cv::Mat sum = soft(picture, 3);
  for (const cv::Mat& band : detail_bands(picture)) sum += band;
  CHECK(cv::norm(sum, picture, cv::NORM_INF) < 1e-6);
  for (const double square : strength_of(cv::Mat(20, 20, CV_32FC3, cv::Scalar::all(0.3))).mean_squares)
    CHECK(square < 1e-12);
}

TEST_CASE("detail match: a soft picture becomes as sharp as another one, within the largest gain") {
  const cv::Mat sharp = noise(0.05, 2), dull = soft(noise(0.05, 3), 0.4);
  const DetailStrength before = strength_of(dull), aim = strength_of(sharp);
  const DetailTransform whole = match_detail(before, aim), half = whole.blended(0.5);
  cv::Mat result = dull.clone();
  whole.apply(result);
  const DetailStrength after = strength_of(result);
  for (std::size_t i = 0; i < aim.mean_squares.size(); ++i) {
    CAPTURE(i);
    const double wanted = std::sqrt(aim.mean_squares[i] / before.mean_squares[i]);
    CHECK(whole.gains[i] == doctest::Approx(std::min(wanted, largest_detail_gain)));
    CHECK(half.gains[i] == doctest::Approx((1 + whole.gains[i]) / 2));
    // Bands overlap: each takes part in the others' gains.
    CHECK(std::sqrt(after.mean_squares[i] / before.mean_squares[i]) ==
          doctest::Approx(whole.gains[i]).epsilon(0.12));
  }
  CHECK(whole.gains[0] > 1.2);
}

TEST_CASE("detail match: nothing is softened, nothing leaves [0, 1], and amount 0 changes nothing") {
  const cv::Mat sharp = noise(0.3, 4), dull = soft(sharp, 2);
  for (const double gain : match_detail(strength_of(sharp), strength_of(dull)).gains) CHECK(gain == 1);
  for (const double gain : match_detail(strength_of(dull), strength_of(sharp)).blended(0).gains)
    CHECK(gain == 1);
  for (const double gain : match_detail(strength_of(dull), strength_of(sharp)).gains)
    CHECK(gain == largest_detail_gain);
  cv::Mat result = sharp.clone();
  const float* place = result.ptr<float>();
  DetailTransform{{1.6, 1.6, 1.6}}.apply(result);
  CHECK(result.ptr<float>() == place);
  double least = 0, most = 0;
  cv::minMaxLoc(result.reshape(1), &least, &most);
  CHECK(least == 0);
  CHECK(most == 1);
}

TEST_CASE("detail match: several pictures have the mean of their strengths, mixtures by their shares") {
  const cv::Mat first = noise(0.1, 5), second = noise(0.02, 6);
  DetailStrength both = strength_of(first), mixed;
  both.add(second);
  mixed.mix(strength_of(first), 0.25);
  mixed.mix(strength_of(second), 0.75);
  for (std::size_t i = 0; i < both.mean_squares.size(); ++i) {
    const double a = strength_of(first).mean_squares[i], b = strength_of(second).mean_squares[i];
    CHECK(both.mean_squares[i] == doctest::Approx((a + b) / 2));
    CHECK(mixed.mean_squares[i] == doctest::Approx(0.25 * a + 0.75 * b));
  }
}
