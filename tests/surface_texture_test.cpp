#include "vivant/model/surface_texture.hpp"

#include <doctest/doctest.h>

#include <Eigen/Dense>
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
    CHECK(rms(here) / rms(texture) == doctest::Approx(1).epsilon(0.1));
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

TEST_CASE("surface texture: floors, side walls and slanted ones") {
  const cv::Mat texture = grains();
  const auto seen_plane = [](double x, const Eigen::Vector3d& normal, double offset) {
    SurfaceView view = wall_seen_from(x, 3);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        const Ray ray = view.camera.ray({u + 0.5, v + 0.5});
        const double depth = (offset - normal.dot(ray.origin)) / normal.dot(ray.direction);
        view.depth.at<float>(v, u) = depth > 0 && depth < 20 ? static_cast<float>(depth) : 0.0f;
      }
    return view;
  };
  const SurfaceFlow flow(nullptr, 1);
  for (const Eigen::Vector3d& normal :
       {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(1, 0, 0.3), Eigen::Vector3d(0.6, 0, 0.8)}) {
    CAPTURE(normal.transpose());
    const SurfaceView first = seen_plane(0, normal, 1), second = seen_plane(0.1, normal, 1);
    const cv::Mat here = seen(first, texture), there = seen(second, texture);
    const cv::Mat forward = flow.flow(first, second),
                  visible = visible_pixels(forward, flow.flow(second, first));
    const cv::Mat moved = warped(there, forward);
    cv::Mat inner(height, width, CV_8UC1, cv::Scalar(0));
    inner(cv::Rect(14, 10, 36, 28)).setTo(255);
    inner &= visible;
    REQUIRE(cv::countNonZero(inner) > 150);
    CHECK(cv::norm(here, moved, cv::NORM_L2, inner) < 0.5 * cv::norm(here, cv::NORM_L2, inner));
  }
  // On walls one axis of the texture is level and the other upright.
  for (const Eigen::Vector3d& normal : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0)}) {
    const bool side = normal.x() > 0;
    const SurfaceTexture surface(flow.rest_points(seen_plane(0, normal, side ? 0.8 : 3)));
    const auto above = surface.places(15, 50), below = surface.places(21, 50);
    REQUIRE(!above.empty());
    REQUIRE(above.size() == below.size());
    for (std::size_t i = 0; i < above.size(); ++i) {
      CHECK(above[i].u == doctest::Approx(below[i].u).epsilon(0.001));
      CHECK(std::abs(above[i].v - below[i].v) > 1);
    }
  }
}

TEST_CASE("surface texture: mixtures keep the mean square around the origin, too") {
  double squares = 0;
  cv::Mat texture = grains();
  const SurfaceTexture surface(SurfaceFlow(nullptr, 1).rest_points(wall_seen_from(0, 3.4)));
  for (int turn = 0; turn < 40; ++turn) {
    cv::Mat shifted(texture.size(), CV_32FC3);
    for (int y = 0; y < texture.rows; ++y)
      for (int x = 0; x < texture.cols; ++x)
        shifted.at<cv::Vec3f>(y, x) =
            texture.at<cv::Vec3f>((y + 7 * turn) % texture.rows, (x + 11 * turn) % texture.cols);
    squares += std::pow(rms(seen(surface, shifted)(cv::Rect(28, 20, 8, 8))), 2) / 40;
  }
  CHECK(std::sqrt(squares) / rms(texture) == doctest::Approx(1).epsilon(0.05));
}
