#include "vivant/model/brushwork.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

using namespace vivant;

namespace {

const cv::Vec3f blue(0.1f, 0.2f, 0.7f), orange(0.75f, 0.5f, 0.2f);
constexpr double brush = 4;

/// Left plain blue; right orange with upright strokes of 4 pixels, in luma.
cv::Mat half_painted() {
  cv::Mat painting(320, 320, CV_32FC3, blue);
  for (int y = 0; y < painting.rows; ++y)
    for (int x = 160; x < painting.cols; ++x)
      painting.at<cv::Vec3f>(y, x) = orange + cv::Vec3f::all(x / 4 % 2 ? 0.06f : -0.06f);
  cv::Mat result;
  painting.convertTo(result, CV_8U, 255);
  return result;
}

cv::Vec3f lab_of(const cv::Vec3f& rgb) {
  cv::Mat pixel(1, 1, CV_32FC3, rgb), lab;
  cv::cvtColor(pixel, lab, cv::COLOR_RGB2Lab);
  return lab.at<cv::Vec3f>(0);
}

/// A wall of pixels that lie one unit apart.
SurfaceTexture wall(cv::Size size) {
  cv::Mat points(size, CV_32FC3);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      points.at<cv::Vec3f>(y, x) = {static_cast<float>(x), static_cast<float>(-y), 0};
  return SurfaceTexture(points);
}

double rms(const cv::Mat& picture) {
  return cv::norm(picture) / std::sqrt(static_cast<double>(3 * picture.total()));
}

/// The root mean square of the steps from the columns [first, first + count) to the ones right of them.
double steps(const cv::Mat& texture, int first, int count) {
  cv::Mat difference(texture.rows, count, CV_32FC3);
  for (int y = 0; y < texture.rows; ++y)
    for (int x = 0; x < count; ++x)
      difference.at<cv::Vec3f>(y, x) = texture.at<cv::Vec3f>(y, (first + x + 1) % texture.cols) -
                                       texture.at<cv::Vec3f>(y, (first + x) % texture.cols);
  return rms(difference);
}

const cv::Size frame(222, 222);  // whose brush is 4 pixels wide

Brushwork brushwork_of(const cv::Mat& painting) {
  const StylePicture picture{painting};
  return {{&picture, 1}, frame};
}

}  // namespace

TEST_CASE("brushwork: the swatch of a tone has the strokes that the painting has there") {
  const std::vector<Swatch> swatches = swatches_of(half_painted(), brush);
  REQUIRE(swatches.size() == 6);
  const auto nearest = [&](const cv::Vec3f& colour) {
    return *std::min_element(swatches.begin(), swatches.end(), [&](const Swatch& a, const Swatch& b) {
      return cv::norm(a.tone - lab_of(colour)) < cv::norm(b.tone - lab_of(colour));
    });
  };
  const Swatch even = nearest(blue), striped = nearest(orange);
  CHECK(cv::norm(even.tone - lab_of(blue)) < 3);
  CHECK(cv::norm(striped.tone - lab_of(orange)) < 6);
  CHECK(even.mean_square < 0.004 * 0.004);
  CHECK(striped.mean_square > 0.03 * 0.03);
  CHECK(rms(striped.strokes) / std::sqrt(striped.mean_square) == doctest::Approx(1).epsilon(0.001));
  CHECK(cv::norm(cv::mean(striped.strokes)) < 1e-5);
  // Upright.
  CHECK(steps(striped.strokes, 0, striped.strokes.cols) >
        4 * steps(striped.strokes.t(), 0, striped.strokes.rows));

  const std::vector<Swatch> again = swatches_of(half_painted(), brush);
  for (std::size_t i = 0; i < swatches.size(); ++i)
    CHECK(cv::norm(swatches[i].strokes, again[i].strokes, cv::NORM_INF) == 0);
}

TEST_CASE("brushwork: a swatch has no seam where it begins again") {
  cv::Mat painting(320, 320, CV_8UC3);
  cv::RNG(3).fill(painting, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(painting, painting, {}, 3);
  for (const Swatch& swatch : swatches_of(painting, brush)) {
    const cv::Mat across = swatch.strokes, down = swatch.strokes.t();
    for (const cv::Mat& strokes : {across, down})
      CHECK(steps(strokes, strokes.cols - 1, 1) < 1.5 * steps(strokes, 0, strokes.cols));
  }
}

TEST_CASE("brushwork: pictures get the strokes of their tones") {
  const Brushwork brushwork = brushwork_of(half_painted());
  const SurfaceTexture surfaces = wall(frame);
  const auto laid = [&](const cv::Mat& picture, double amount) {
    return cv::Mat(brushwork.laid_onto(picture, surfaces, amount) - picture);
  };
  const cv::Mat plain_orange(frame, CV_32FC3, orange), plain_blue(frame, CV_32FC3, blue);
  const double once = rms(laid(plain_orange, 1));
  CHECK(once > 0.02);
  CHECK(once < 0.08);
  CHECK(rms(laid(plain_blue, 1)) < 0.2 * once);
  CHECK(rms(laid(plain_orange, 0)) == 0);
  CHECK(rms(laid(plain_orange, 0.5)) / once == doctest::Approx(0.5).epsilon(0.01));

  // There is little room for strokes where detail is.
  cv::Mat detailed = plain_orange.clone();
  for (int x = 0; x < detailed.cols; ++x) detailed.col(x) += cv::Scalar::all(x % 2 ? 0.1 : -0.1);
  CHECK(rms(laid(detailed, 1)) < 0.6 * once);

  // No colour leaves [0, 1].
  const cv::Mat white(frame, CV_32FC3, cv::Scalar::all(1));
  double most = 0;
  cv::minMaxLoc(cv::Mat(white + laid(white, 2)).reshape(1), nullptr, &most);
  CHECK(most <= 1);
}

TEST_CASE("brushwork: paintings that are tiny, of one colour, or narrow") {
  cv::Mat tiny(9, 7, CV_8UC3, cv::Scalar(200, 30, 30));
  tiny.at<cv::Vec3b>(4, 4) = {0, 0, 255};
  for (const cv::Mat& painting :
       {tiny, cv::Mat(1, 1, CV_8UC3, cv::Scalar(9, 9, 9)), cv::Mat(1, 5000, CV_8UC3, cv::Scalar(1, 99, 9)),
        cv::Mat(64, 64, CV_8UC3, cv::Scalar(10, 120, 60)),
        cv::Mat(20, 900, CV_8UC3, cv::Scalar(250, 250, 250))}) {
    const std::vector<Swatch> swatches = swatches_of(painting, brush);
    CHECK(swatches.size() == 6);
    for (const Swatch& swatch : swatches) {
      CHECK(cv::checkRange(swatch.strokes));
      CHECK(!swatch.strokes.empty());
    }
    const cv::Mat picture(frame, CV_32FC3, orange);
    CHECK(
        cv::checkRange(brushwork_of(painting).laid_onto(picture, wall(frame), 1), true, nullptr, 0, 1.0001));
  }
}

TEST_CASE("brushwork: in a mixture each painting's swatches count by its weight") {
  cv::Mat plain(320, 320, CV_8UC3, cv::Scalar(191, 128, 51));  // orange without strokes
  const auto strength = [&](double share) {
    const std::vector<StylePicture> paintings = {{half_painted(), share}, {plain, 1 - share}};
    const cv::Mat picture(frame, CV_32FC3, orange);
    return rms(Brushwork(paintings, frame).laid_onto(picture, wall(frame), 1) - picture);
  };
  CHECK(strength(0.9) > 1.3 * strength(0.3));
}

TEST_CASE("brushwork: by lightness alone a grey picture gets the strokes of colourful tones as light") {
  const Brushwork brushwork = brushwork_of(half_painted());  // orange with strokes, and a darker blue without
  const auto strength = [&](double grey, bool by_lightness) {
    const cv::Mat picture(frame, CV_32FC3, cv::Scalar::all(grey));
    return rms(brushwork.laid_onto(picture, wall(frame), 1, by_lightness) - picture);
  };
  const double as_light_as_orange = 0.56, as_blue = 0.24;
  CHECK(strength(as_light_as_orange, true) > 4 * strength(as_blue, true));
  CHECK(strength(as_light_as_orange, true) != strength(as_light_as_orange, false));
}

TEST_CASE("brushwork: the same bits with one thread and with many") {
  const int threads = cv::getNumThreads();
  cv::Mat laid[2];
  for (int i = 0; i < 2; ++i) {
    cv::setNumThreads(i == 0 ? 1 : 4);
    laid[i] = brushwork_of(half_painted()).laid_onto(cv::Mat(frame, CV_32FC3, orange), wall(frame), 1);
  }
  cv::setNumThreads(threads);
  CHECK(cv::norm(laid[0], laid[1], cv::NORM_INF) == 0);
}
