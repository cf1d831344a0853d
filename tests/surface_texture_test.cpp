#include "vivant/model/surface_texture.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "vivant/jobs/flow.hpp"

using namespace vivant;

namespace {

constexpr int width = 64, height = 48;

/// A view of the wall z = `distance`; its depth is off by up to `noise` at every pixel.
SurfaceView wall_seen_from(double x, double distance, double noise = 0) {
  Camera camera{.width = width, .height = height, .fx = 60, .fy = 60, .cx = 32, .cy = 24};
  camera.world_to_camera(0, 3) = -x;
  cv::Mat depth(height, width, CV_32FC1), errors(height, width, CV_32FC1);
  cv::RNG(static_cast<std::uint64_t>(1000 * x) + 5).fill(errors, cv::RNG::UNIFORM, -noise, noise);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      depth.at<float>(v, u) =
          static_cast<float>(distance / camera.forward().dot(camera.ray({u + 0.5, v + 0.5}).direction)) +
          errors.at<float>(v, u);
  return {camera, depth, {}};
}

/// A texture of mean 0 that repeats itself, whose grains are some texels wide.
cv::Mat grains() {
  cv::Mat noise(96, 80, CV_32FC3), tiled, smooth;
  cv::RNG(7).fill(noise, cv::RNG::NORMAL, 0.0, 1.0);
  cv::copyMakeBorder(noise, tiled, 16, 16, 16, 16, cv::BORDER_WRAP);
  cv::GaussianBlur(tiled, smooth, {}, 2);
  const cv::Mat middle = smooth(cv::Rect(16, 16, 80, 96)).clone();
  return middle - cv::mean(middle);
}

double rms(const cv::Mat& picture) {
  return cv::norm(picture) / std::sqrt(static_cast<double>(3 * picture.total()));
}

cv::Mat seen(const SurfaceTexture& surface, const cv::Mat& texture) {
  cv::Mat picture(height, width, CV_32FC3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) picture.at<cv::Vec3f>(y, x) = look_up(texture, surface.places(y, x));
  return picture;
}

cv::Mat seen(const SurfaceView& view, const cv::Mat& texture) {
  return seen(SurfaceTexture(SurfaceFlow(nullptr, 1).rest_points(view)), texture);
}

}  // namespace

TEST_CASE("surface texture: it stays on the wall when the camera moves") {
  const cv::Mat texture = grains();
  for (const double noise : {0.0, 0.02}) {
    CAPTURE(noise);
    const SurfaceView first = wall_seen_from(0, 3, noise), second = wall_seen_from(0.15, 3, noise);
    const cv::Mat here = seen(first, texture), there = seen(second, texture);
    const cv::Rect shared(14, 10, 36, 28);  // not smoothed at a border
    const cv::Mat moved =
        warped(there, SurfaceFlow(nullptr, 1).flow(wall_seen_from(0, 3), wall_seen_from(0.15, 3)));
    CHECK(rms(here(shared) - moved(shared)) < (noise > 0 ? 0.3 : 0.01) * rms(here(shared)));
    CHECK(rms(here(shared) - there(shared)) > 0.5 * rms(here(shared)));
    CHECK(rms(here) == doctest::Approx(rms(texture)).epsilon(0.2));
  }
}

TEST_CASE("surface texture: grains are as large in the picture from near and from far") {
  const cv::Mat texture = grains();
  for (const double distance : {1.0, 1.4, 2.7, 40.0}) {
    CAPTURE(distance);
    const cv::Mat picture = seen(wall_seen_from(0, distance), texture);
    cv::Mat step;
    cv::filter2D(picture, step, CV_32F, cv::Matx13f(0, -1, 1));
    cv::Mat own_step;
    cv::filter2D(texture, own_step, CV_32F, cv::Matx13f(0, -1, 1));
    const double finer = SurfaceTexture::texel * (rms(step) / rms(picture)) / (rms(own_step) / rms(texture));
    CHECK(finer > 0.7);
    CHECK(finer < 1.5);
  }
}

TEST_CASE("surface texture: nothing where there is no surface, and no smoothing over an edge") {
  cv::Mat points = SurfaceFlow(nullptr, 1).rest_points(wall_seen_from(0, 3));
  const cv::Mat texture = grains(), alone = seen(SurfaceTexture(points), texture);
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  points(cv::Rect(0, 0, 20, height)).setTo(cv::Scalar::all(unknown));
  const cv::Mat holed = seen(SurfaceTexture(points), texture);
  CHECK(cv::norm(holed(cv::Rect(0, 0, 20, height))) == 0);
  CHECK(cv::checkRange(holed));
  const cv::Rect right(40, 4, 20, 40);
  CHECK(rms(holed(right) - alone(right)) < 0.01 * rms(alone(right)));

  // On the left half another wall: the right one's points are as they were up to the edge.
  cv::Mat both = SurfaceFlow(nullptr, 1).rest_points(wall_seen_from(0, 3));
  const cv::Rect left(0, 0, 32, height), beyond(34, 10, 8, 28);
  both(left) += cv::Scalar(5, 0, 0);
  const cv::Mat edged = seen(SurfaceTexture(both), texture);
  CHECK(rms(edged(beyond) - alone(beyond)) < 0.05 * rms(alone(beyond)));
}
