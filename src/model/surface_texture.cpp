#include "vivant/model/surface_texture.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace vivant {
namespace {

constexpr int smoothing_radius = 4;         // pixels
constexpr double least_determinant = 0.1;   // of the neighbours' places
constexpr double facing_power = 6;          // the larger, the sharper the seams between the axes
constexpr double longer_step_share = 0.75;  // of a pixel's size: else surfaces seen at a slant flicker
constexpr float least_weight = 0.01f;       // of a place

bool known(const cv::Vec3f& point) {
  return std::isfinite(point[0]) && std::isfinite(point[1]) && std::isfinite(point[2]);
}

/// The pixel's step to its neighbours in one direction: the smaller one, which does not lead over an edge;
/// NaN where none is known.
cv::Vec3f step_at(const cv::Mat& points, int y, int x, int down, int right) {
  const auto point = [&](int way) {
    const int row = std::clamp(y + way * down, 0, points.rows - 1),
              column = std::clamp(x + way * right, 0, points.cols - 1);
    return points.at<cv::Vec3f>(row, column);
  };
  const bool first = (down ? y : x) == 0, last = (down ? y + 1 == points.rows : x + 1 == points.cols);
  const cv::Vec3f forward = point(1) - point(0), backward = point(0) - point(-1);
  if (first || !known(backward)) return forward;
  if (last || !known(forward)) return backward;
  return forward.dot(forward) < backward.dot(backward) ? forward : backward;
}

/// The middle of the numbers around a pixel, up to two pixels away, of those above 0; 0 without any.
float median_around(const cv::Mat& numbers, int y, int x) {
  std::vector<float> known;
  for (int v = std::max(0, y - 2); v <= std::min(numbers.rows - 1, y + 2); ++v)
    for (int u = std::max(0, x - 2); u <= std::min(numbers.cols - 1, x + 2); ++u)
      if (const float number = numbers.at<float>(v, u); number > 0) known.push_back(number);
  if (known.empty()) return 0;
  const auto middle = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
  std::nth_element(known.begin(), middle, known.end());
  return *middle;
}

/// How far neighbouring pixels are apart on the surface, CV_32FC1; 0 where it is not known.
cv::Mat step_lengths(const cv::Mat& points) {
  cv::Mat lengths(points.size(), CV_32FC1, cv::Scalar(0)), calm(points.size(), CV_32FC1);
  for (int y = 0; y < points.rows; ++y)
    for (int x = 0; x < points.cols; ++x)
      for (const cv::Vec3f& step : {step_at(points, y, x, 1, 0), step_at(points, y, x, 0, 1)})
        if (known(step))
          lengths.at<float>(y, x) = std::max(lengths.at<float>(y, x), static_cast<float>(cv::norm(step)));
  for (int y = 0; y < points.rows; ++y)
    for (int x = 0; x < points.cols; ++x) calm.at<float>(y, x) = median_around(lengths, y, x);
  return calm;
}

/// The surface at a pixel: its point and its steps to the next pixels.
struct Tangent {
  cv::Vec3f point, right, down;
};

/// The plane through the neighbours of a pixel, the less the farther they are on the surface beside what they
/// are in the picture, and not through those beyond an edge. (A mean would be drawn away from edges, where
/// there are none beyond.)
Tangent tangent_at(const cv::Mat& points, int y, int x, float step) {
  const cv::Vec3f& here = points.at<cv::Vec3f>(y, x);
  const int top = std::max(0, y - smoothing_radius), bottom = std::min(points.rows - 1, y + smoothing_radius);
  const int left = std::max(0, x - smoothing_radius), right = std::min(points.cols - 1, x + smoothing_radius);
  cv::Matx33d moments = cv::Matx33d::zeros(), values = cv::Matx33d::zeros();
  for (int v = top; v <= bottom; ++v)
    for (int u = left; u <= right; ++u) {
      const cv::Vec3f difference = points.at<cv::Vec3f>(v, u) - here;
      if (!known(difference)) continue;
      const auto pixels = static_cast<float>((v - y) * (v - y) + (u - x) * (u - x));
      const float near = step * (2 + 1.5f * std::sqrt(pixels)),
                  apart = difference.dot(difference) / (near * near);
      if (apart > 9) continue;  // beyond an edge
      const double weight = std::exp(-2 * pixels / (smoothing_radius * smoothing_radius) - apart);
      const cv::Vec3d place(1, u - x, v - y);
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          moments(i, k) += weight * place[i] * place[k];
          values(i, k) += weight * place[i] * difference[k];
        }
    }
  if (cv::determinant(moments) < least_determinant)  // too few, or all in a line
    return {here, step_at(points, y, x, 0, 1), step_at(points, y, x, 1, 0)};
  const cv::Matx33d plane = moments.solve(values, cv::DECOMP_LU);
  const auto row = [&](int i) { return cv::Vec3f(cv::Vec3d(plane(i, 0), plane(i, 1), plane(i, 2))); };
  return {here + row(0), row(1), row(2)};
}

/// Does it for every pixel that shows a point, in any order.
void for_tangents(const cv::Mat& points, const std::function<void(int y, int x, const Tangent&)>& use) {
  const cv::Mat steps = step_lengths(points);
  cv::parallel_for_({0, points.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y)
      for (int x = 0; x < points.cols; ++x)
        if (known(points.at<cv::Vec3f>(y, x)) && steps.at<float>(y, x) > 0)
          use(y, x, tangent_at(points, y, x, steps.at<float>(y, x)));
  });
}

/// The texture at a place in texels, bilinear; it repeats itself.
cv::Vec3f wrapped(const cv::Mat& texture, double u, double v) {
  const double left = std::floor(u), top = std::floor(v);
  const auto index = [](double place, int size) {
    const int at = static_cast<int>(std::fmod(place, size));
    return at < 0 ? at + size : at;
  };
  const int x = index(left, texture.cols), y = index(top, texture.rows);
  const int right = (x + 1) % texture.cols, below = (y + 1) % texture.rows;
  const auto a = static_cast<float>(u - left), b = static_cast<float>(v - top);
  return (1 - b) * ((1 - a) * texture.at<cv::Vec3f>(y, x) + a * texture.at<cv::Vec3f>(y, right)) +
         b * ((1 - a) * texture.at<cv::Vec3f>(below, x) + a * texture.at<cv::Vec3f>(below, right));
}

}  // namespace

SurfaceTexture::SurfaceTexture(const cv::Mat& points)
    : points_(points.size(), CV_32FC3, cv::Scalar::all(std::numeric_limits<double>::quiet_NaN())),
      facing_(points.size(), CV_32FC3),
      octaves_(points.size(), CV_32FC1) {
  cv::Mat calm = points.clone();
  for_tangents(points,
               [&](int y, int x, const Tangent& tangent) { calm.at<cv::Vec3f>(y, x) = tangent.point; });
  for_tangents(calm, [&](int y, int x, const Tangent& tangent) {
    const cv::Vec3d normal = tangent.right.cross(tangent.down);
    const double a = cv::norm(tangent.right), b = cv::norm(tangent.down), length = cv::norm(normal);
    if (!(length > 0)) return;
    cv::Vec3d facing;
    for (int i = 0; i < 3; ++i) facing[i] = std::pow(std::abs(normal[i]) / length, facing_power);
    facing_.at<cv::Vec3f>(y, x) = facing * (1 / (facing[0] + facing[1] + facing[2]));
    octaves_.at<float>(y, x) =
        static_cast<float>(std::log2(texel) + longer_step_share * std::log2(std::max(a, b)) +
                           (1 - longer_step_share) * std::log2(std::min(a, b)));
    points_.at<cv::Vec3f>(y, x) = tangent.point;
  });
}

std::vector<SurfaceTexture::Place> SurfaceTexture::places(int y, int x) const {
  const cv::Vec3f& point = points_.at<cv::Vec3f>(y, x);
  std::vector<Place> places;
  if (!known(point)) return places;
  const cv::Vec3f& facing = facing_.at<cv::Vec3f>(y, x);
  const float octave = octaves_.at<float>(y, x), lower = std::floor(octave), upper_share = octave - lower;
  float squares = 0;
  for (const float coarser : {0.0f, 1.0f}) {
    const double octave_here = lower + coarser, size = std::exp2(octave_here);
    for (int axis = 0; axis < 3; ++axis) {
      const float weight = (coarser > 0 ? upper_share : 1 - upper_share) * facing[axis];
      if (weight < least_weight) continue;
      // Upright on walls where y is up; shifted, so that neither axes nor octaves show the same.
      const double u = axis == 0 ? point[2] : point[0], v = axis == 1 ? point[2] : point[1];
      places.push_back({u / size + 37.7 * axis + 53.3 * octave_here,
                        -v / size + 91.3 * axis + 71.9 * octave_here, weight});
      squares += weight * weight;
    }
  }
  for (Place& place : places) place.weight /= std::sqrt(squares);
  return places;
}

cv::Vec3f look_up(const cv::Mat& texture, const std::vector<SurfaceTexture::Place>& places) {
  cv::Vec3f colours(0, 0, 0);
  for (const SurfaceTexture::Place& place : places)
    colours += place.weight * wrapped(texture, place.u, place.v);
  return colours;
}

}  // namespace vivant
