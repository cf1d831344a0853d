#include "vivant/nn/stlpips.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/json.hpp"

using namespace vivant;
namespace fs = std::filesystem;

namespace {

cv::Mat style(const char* name, cv::Size size) {
  cv::Mat picture;
  cv::resize(read_image(asset_path(std::string("styles/") + name)), picture, size, 0, 0, cv::INTER_AREA);
  return picture;
}

}  // namespace

TEST_CASE("ST-LPIPS: distances agree with its authors' package") {
  const fs::path data = VIVANT_SHARED_DATA;
  if (!fs::exists(data / "oracles/stlpips_tennis.json")) {
    MESSAGE("skipped: no " << (data / "oracles/stlpips_tennis.json"));
    return;
  }
  const nlohmann::json pairs = read_json(data / "oracles/stlpips_tennis.json").at("pairs");
  StLpips metric(test_device());
  const auto frame = [&](const char* name) { return read_image(data / "tennis/images" / name); };
  const cv::Mat first = frame("0020.png");
  CHECK(metric.distance(first, first) == 0);
  for (const auto& [name, other] :
       {std::pair("tennis0020_vs_0021", "0021.png"), std::pair("tennis0020_vs_0025", "0025.png"),
        std::pair("tennis0020_vs_0040", "0040.png")}) {
    CAPTURE(name);
    CHECK(metric.distance(first, frame(other)) ==
          doctest::Approx(pairs.at(name).get<double>()).epsilon(1e-3));
  }
  cv::Mat blurred;
  cv::blur(first, blurred, {7, 7}, {-1, -1}, cv::BORDER_REFLECT_101);
  CHECK(metric.distance(first, blurred) ==
        doctest::Approx(pairs.at("tennis0020_boxblur7_reflect").get<double>()).epsilon(5e-3));
}

TEST_CASE("ST-LPIPS: order of distances, and masks") {
  StLpips metric(test_device());
  const cv::Size size(64, 48);
  const cv::Mat picture = style("cubist.jpg", size), other = style("ink_wash.jpg", size);
  cv::Mat moved, blurred;
  cv::warpAffine(picture, moved, cv::Matx23d(1, 0, 1, 0, 1, 0), size, cv::INTER_LINEAR,
                 cv::BORDER_REFLECT_101);
  const double shift = metric.distance(picture, moved), far = metric.distance(picture, other);
  CHECK(shift > 0);
  CHECK(shift < far / 2);
  CHECK(metric.distance(other, picture) == doctest::Approx(far).epsilon(1e-4));

  // What lies outside of the mask does not count; inside it does.
  const cv::Rect left(0, 0, 24, 48);
  cv::Mat half = picture.clone(), mask(size, CV_8UC1, cv::Scalar(0));
  other(left).copyTo(half(left));
  mask(left) = 255;
  CHECK(metric.distance(picture, half, 255 - mask) == 0);
  CHECK(metric.distance(picture, half, mask) > 1.5 * metric.distance(picture, half));
  CHECK(metric.distance(picture, half, cv::Mat(size, CV_8UC1, cv::Scalar(255))) ==
        doctest::Approx(metric.distance(picture, half)).epsilon(1e-6));
  CHECK_THROWS_AS(metric.distance(picture, half, cv::Mat(size, CV_8UC1, cv::Scalar(0))), Error);
  CHECK_THROWS_AS(metric.distance(picture, style("cubist.jpg", {65, 48})), Error);
  CHECK_THROWS_AS(metric.distance(style("cubist.jpg", {31, 48}), style("cubist.jpg", {31, 48})), Error);
}
