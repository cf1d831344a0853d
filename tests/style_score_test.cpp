#include "vivant/model/style_score.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>

#include "graph_helpers.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/image.hpp"

using namespace vivant;

TEST_CASE("style score: nearest for the painting itself, far for others; content is what a picture keeps") {
  const auto painting = [](const char* name) {
    cv::Mat picture;
    cv::resize(read_image(asset_path(std::string("styles/") + name)), picture, {96, 96}, 0, 0,
               cv::INTER_AREA);
    return picture;
  };
  const cv::Mat ink = painting("ink_wash.jpg"), mosaic = painting("mosaic.jpg");
  const Vgg19 vgg(test_device());
  StyleMeter meter(test_device(), vgg, ink);
  const StyleScore self = meter.score(ink, ink), other = meter.score(mosaic, ink);
  CHECK(self.statistics < 1e-5);
  CHECK(self.gram < 1e-5);
  CHECK(self.content < 1e-5);
  CHECK(other.statistics > 0.3);
  CHECK(other.gram > 0.3);
  CHECK(other.content > 0.8);
  CHECK(other.content < 1.5);
  const StyleScore alone = meter.distance(mosaic);
  CHECK(alone.statistics == other.statistics);
  CHECK(alone.gram == other.gram);
  CHECK(alone.content == 0);

  // Mirrored, a picture keeps its style and loses its content.
  cv::Mat mirrored;
  cv::flip(ink, mirrored, 1);
  const StyleScore same_style = meter.score(mirrored, ink);
  CHECK(same_style.statistics < other.statistics / 3);
  CHECK(same_style.gram < other.gram / 3);
  CHECK(same_style.content > 0.5);
  // Blurred, the other way round.
  cv::Mat blurred;
  cv::GaussianBlur(ink, blurred, {}, 1.5);
  CHECK(meter.score(blurred, ink).statistics > same_style.statistics);
  CHECK(meter.score(blurred, ink).content < same_style.content);
}
