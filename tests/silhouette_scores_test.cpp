#include "vivant/jobs/silhouette_scores.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace vivant;

namespace {

const cv::Rect trunk(20, 10, 20, 40), head(27, 4, 6, 6), hand(40, 20, 10, 10), foot(30, 50, 4, 5);

/// A trunk of 800 pixels with a head of 36, a left hand of 100 and a left foot of 20.
BodySilhouette body() {
  BodySilhouette body{cv::Mat(64, 96, CV_8UC1, cv::Scalar(0)), cv::Mat(64, 96, CV_32SC1, cv::Scalar(-1))};
  for (const cv::Rect& part : {trunk, head, hand, foot}) body.mask(part) = 255;
  body.limb(head) = 0;
  body.limb(hand) = 3;
  body.limb(foot) = 6;
  return body;
}

}  // namespace

TEST_CASE("silhouette scores: intersection over union") {
  const cv::Mat whole = body().mask;
  cv::Mat none = cv::Mat::zeros(whole.size(), CV_8UC1), without_hand = whole.clone();
  without_hand(hand) = 0;
  CHECK(silhouette_iou(whole, whole) == 1);
  CHECK(silhouette_iou(without_hand, whole) == doctest::Approx(856.0 / 956));
  CHECK(silhouette_iou(none, whole) == 0);
  CHECK(silhouette_iou(none, none) == 0);
}

TEST_CASE("silhouette scores: a missing hand is named, one that is too small is not looked at") {
  const BodySilhouette posed = body();
  cv::Mat rendered = posed.mask.clone();
  rendered(foot) = 0;
  CHECK(least_covered_limb(rendered, posed)->share == 1);
  rendered(cv::Rect(hand.x, hand.y, hand.width, 6)) = 0;
  CHECK(least_covered_limb(rendered, posed)->share == doctest::Approx(0.4));
  rendered(hand) = 0;
  const std::optional<LimbCover> missing = least_covered_limb(rendered, posed);
  REQUIRE(missing);
  CHECK(missing->share == 0);
  CHECK(missing->limb == std::string("left hand"));

  BodySilhouette without = posed;
  without.limb = -1;
  CHECK_FALSE(least_covered_limb(rendered, without));
}

TEST_CASE(
    "silhouette scores: a piece off the body is detached, one that the picture cuts off the body is not") {
  const BodySilhouette posed = body();
  cv::Mat rendered = posed.mask.clone();
  CHECK(detached_share(rendered, posed.mask) == 0);
  rendered(cv::Rect(70, 5, 8, 10)) = 255;  // 80 pixels beside the 956 of the body
  CHECK(detached_share(rendered, posed.mask) == doctest::Approx(80.0 / 1036));
  CHECK(detached_share(rendered, rendered) == 0);
  CHECK(detached_share(posed.mask, rendered) == 0);
  rendered(cv::Rect(50, 0, 20, 5)) = 255;  // meets that piece at a corner
  CHECK(detached_share(rendered, posed.mask) == doctest::Approx(180.0 / 1136));
  cv::Mat cut = posed.mask.clone();  // a body in two pieces, the smaller of which is not rendered
  cut(cv::Rect(0, 0, 8, 10)) = 255;
  CHECK(detached_share(rendered, cut) == doctest::Approx(180.0 / 1136));
  CHECK(detached_share(cv::Mat::zeros(rendered.size(), CV_8UC1), posed.mask) == 0);
}
