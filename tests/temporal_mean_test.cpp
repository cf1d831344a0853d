#include "vivant/jobs/temporal_mean.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>

#include "vivant/io/assets.hpp"
#include "vivant/io/image.hpp"
#include "vivant/model/detail_match.hpp"

using namespace vivant;

namespace {

constexpr int width = 80, height = 64, step = 3;

/// A painting that moves to the left by `step` pixels a frame.
cv::Mat moving(int t) {
  cv::Mat painted, colours;
  cv::resize(read_image(asset_path("styles/cubist.jpg")), painted, {width + 4 * step, height}, 0, 0,
             cv::INTER_AREA);
  painted.colRange(step * t, step * t + width).convertTo(colours, CV_32F, 1.0 / 255);
  return colours.clone();
}

cv::Mat constant_flow(double x) { return cv::Mat(height, width, CV_32FC2, cv::Scalar(x, 0)); }

cv::Mat with_noise(const cv::Mat& picture, int seed) {
  cv::Mat noise(picture.size(), CV_32FC3);
  cv::RNG(seed).fill(noise, cv::RNG::NORMAL, 0, 0.1);
  return picture + noise;
}

double rms(const cv::Mat& a, const cv::Mat& b, const cv::Rect& where) {
  return cv::norm(a(where), b(where)) / std::sqrt(3.0 * where.area());
}

}  // namespace

TEST_CASE("temporal mean: flicker averages out along the flow, and nothing else changes") {
  const cv::Mat here = moving(1), before = moving(0), after = moving(2);
  const cv::Mat to_before = constant_flow(step), to_after = constant_flow(-step);
  const auto trust = [&](const cv::Mat& there, const cv::Mat& forward, const cv::Mat& backward) {
    return trust_in(here, there, {}, best_flow(here, there, {{forward, backward}}));
  };
  const cv::Mat trust_before = trust(before, to_before, to_after),
                trust_after = trust(after, to_after, to_before);
  const cv::Mat painted = with_noise(here, 1);
  const cv::Mat mean = temporal_mean(painted, {{with_noise(before, 2), to_before, trust_before},
                                               {with_noise(after, 3), to_after, trust_after}})
                           .colours;
  const int border = surroundings + step;
  const cv::Rect inside(border, 0, width - 2 * border, height);
  CHECK(std::abs(rms(painted, here, inside) / 0.1 - 1) < 0.03);
  CHECK(std::abs(rms(mean, here, inside) / (0.1 / std::sqrt(3.0)) - 1) < 0.05);
  // Near a border one neighbour is known alone: this surface comes into view, or leaves it.
  const double alone = 0.1 / std::sqrt(2.0);
  CHECK(std::abs(rms(mean, here, {0, 0, step, height}) / alone - 1) < 0.1);
  CHECK(std::abs(rms(mean, here, {width - step, 0, step, height}) / alone - 1) < 0.1);
  CHECK(cv::norm(temporal_mean(painted, {}).colours, painted) == 0);
}

TEST_CASE("temporal mean: only the same surface in the same surroundings is trusted") {
  const cv::Mat here(height, width, CV_32FC3, cv::Scalar::all(0.5)), still = constant_flow(0);
  const auto trust = [&](const cv::Mat& there, const cv::Mat& person, const cv::Mat& backward, int y, int x) {
    return trust_in(here, there, person, best_flow(here, there, {{still, backward}})).at<float>(y, x);
  };
  const cv::Mat brighter = here + cv::Scalar::all(colour_scale);
  CHECK(trust(here, {}, still, 30, 40) == 1);
  CHECK(trust(brighter, {}, still, 30, 40) == doctest::Approx(std::exp(-0.5)));
  CHECK(trust(here + cv::Scalar::all(0.5), {}, still, 30, 40) < 1e-6);

  // A pixel that something else hides there says nothing, nor do pixels near it, but on the person.
  cv::Mat hidden = still.clone(), person = cv::Mat::zeros(height, width, CV_32FC1);
  hidden(cv::Rect(40, 28, 5, 5)).setTo(cv::Scalar(20, 0));
  person.colRange(0, 40).setTo(1);
  CHECK(trust(here, person, hidden, 30, 40) == 0);
  CHECK(trust(here, person, hidden, 30, 44 + surroundings) == 0);
  CHECK(trust(here, person, hidden, 30, 45 + surroundings) == 1);
  CHECK(trust(here, person, hidden, 30, 39) == 1);
  CHECK(trust(here, {}, hidden, 30, 39) == 0);
  cv::Mat speck = still.clone();
  speck.at<cv::Vec2f>(30, 40) = {20, 0};
  CHECK(trust(here, {}, speck, 30, 40) == 0);
  CHECK(trust(here, {}, speck, 30, 42) == 1);
}

TEST_CASE("temporal mean: of several flows the one that finds the colours again, pixel by pixel") {
  const cv::Mat here = moving(1), after = moving(2);
  cv::Mat first = constant_flow(-step), second = constant_flow(-step);
  first.colRange(0, 40).setTo(cv::Scalar(2, 1));
  second.colRange(40, width).setTo(cv::Scalar(-1, 3));
  const Correspondence found = best_flow(here, after, {{first, -first}, {second, -second}});
  int right = 0, seen = 0;
  for (int y = 8; y < height - 8; ++y)
    for (int x = 8; x < width - 8; ++x) {
      if (!found.visible.at<std::uint8_t>(y, x)) continue;
      ++seen;
      right += found.flow.at<cv::Vec2f>(y, x) == cv::Vec2f(-step, 0);
    }
  CHECK(seen > 0.7 * (width - 16) * (height - 16));
  CHECK(right > 0.95 * seen);
}

TEST_CASE("temporal mean: detail that the mean took comes back where it took it, and no more") {
  const cv::Mat painted = moving(1), still = constant_flow(0);
  const cv::Rect left(0, 0, width / 2 - 12, height), right(width / 2 + 12, 0, width / 2 - 12, height);
  cv::Mat trust(painted.size(), CV_32FC1, cv::Scalar(1)), soft;
  trust.colRange(0, width / 2).setTo(0);
  const auto detail = [&](const cv::Mat& picture, double coarse, double fine) {
    cv::Mat low, high = picture;
    cv::GaussianBlur(picture, low, {}, coarse);
    if (fine > 0) cv::GaussianBlur(picture, high, {}, fine);
    return cv::norm(high(right), low(right));
  };
  for (const double blur : {0.6, 4.0}) {
    CAPTURE(blur);
    cv::GaussianBlur(painted, soft, {}, blur);
    const cv::Mat mean =
        with_detail_of(painted, temporal_mean(painted, {{soft, still, trust}, {soft, still, trust}}));
    CHECK(cv::norm(mean(left), painted(left), cv::NORM_INF) < 1e-6);  // nothing was averaged there
    const cv::Mat plain = (painted + 2 * soft) / 3;
    for (const auto& [coarse, fine] : {std::pair(3.0, 1.0), {1.0, 0.5}, {0.5, 0.0}}) {
      CAPTURE(coarse);
      const double before = detail(plain, coarse, fine), after = detail(mean, coarse, fine),
                   aim = detail(painted, coarse, fine);
      CHECK(after > 1.02 * before);
      CHECK(after < 1.1 * std::min(aim, largest_detail_gain * before));
      CHECK(after > 0.8 * std::min(aim, largest_detail_gain * before));
    }
  }
}
