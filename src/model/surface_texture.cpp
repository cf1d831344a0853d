#include "vivant/model/surface_texture.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vivant {
namespace {

constexpr int smoothing_radius = 4;        // pixels
constexpr double facing_power = 6;         // the larger, the sharper the seams between the axes
constexpr double least_determinant = 0.1;  // of the neighbours' places
constexpr float least_weight = 0.01f;      // of a texture that is looked up

bool known(const cv::Vec3f& point) { return std::isfinite(point[0]); }

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

/// How far neighbouring pixels are apart on the surface, CV_32FC1; 0 where it is not known.
cv::Mat step_lengths(const cv::Mat& points) {
  cv::Mat lengths(points.size(), CV_32FC1), calm;
  for (int y = 0; y < points.rows; ++y)
    for (int x = 0; x < points.cols; ++x) {
      const double length =
          std::max(cv::norm(step_at(points, y, x, 1, 0)), cv::norm(step_at(points, y, x, 0, 1)));
      lengths.at<float>(y, x) = std::isfinite(length) ? static_cast<float>(length) : 0.0f;
    }
  cv::medianBlur(lengths, calm, 5);
  return calm;
}

/// The point that a plane through the neighbours of a pixel has there: of those that are about as near on the
/// surface as they are in the picture. (A mean would be drawn away from edges, where there are none beyond.)
cv::Vec3f on_plane(const cv::Mat& points, int y, int x, float step) {
  const cv::Vec3f& here = points.at<cv::Vec3f>(y, x);
  const int top = std::max(0, y - smoothing_radius), bottom = std::min(points.rows - 1, y + smoothing_radius);
  const int left = std::max(0, x - smoothing_radius), right = std::min(points.cols - 1, x + smoothing_radius);
  cv::Matx33d moments = cv::Matx33d::zeros(), values = cv::Matx33d::zeros();
  for (int v = top; v <= bottom; ++v)
    for (int u = left; u <= right; ++u) {
      const cv::Vec3f difference = points.at<cv::Vec3f>(v, u) - here;
      if (!known(difference)) continue;
      const auto pixels = static_cast<float>((v - y) * (v - y) + (u - x) * (u - x));
      const float near = step * (2 + 1.5f * std::sqrt(pixels));
      const double weight = std::exp(-2 * pixels / (smoothing_radius * smoothing_radius) -
                                     difference.dot(difference) / (near * near));
      const cv::Vec3d place(1, u - x, v - y);
      moments += weight * place * place.t();
      values += weight * place * cv::Vec3d(difference).t();
    }
  if (cv::determinant(moments) < least_determinant) return here;  // too few, or all in a line
  const cv::Matx33d plane = moments.solve(values, cv::DECOMP_LU);
  return here + cv::Vec3f(cv::Vec3d(plane(0, 0), plane(0, 1), plane(0, 2)));
}

/// Every point on the plane through its neighbours.
cv::Mat smoothed(const cv::Mat& points) {
  const cv::Mat steps = step_lengths(points);
  cv::Mat result = points.clone();
  for (int y = 0; y < points.rows; ++y)
    for (int x = 0; x < points.cols; ++x)
      if (known(points.at<cv::Vec3f>(y, x)) && steps.at<float>(y, x) > 0)
        result.at<cv::Vec3f>(y, x) = on_plane(points, y, x, steps.at<float>(y, x));
  return result;
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
    : points_(smoothed(smoothed(points))),
      facing_(points.size(), CV_32FC3, cv::Scalar::all(1.0 / 3)),
      octaves_(points.size(), CV_32FC1, cv::Scalar(0)) {
  cv::Mat surface(points.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < points.rows; ++y)
    for (int x = 0; x < points.cols; ++x) {
      const cv::Vec3f right = step_at(points_, y, x, 0, 1), down = step_at(points_, y, x, 1, 0);
      const cv::Vec3f normal = right.cross(down);
      const double area = cv::norm(right) * cv::norm(down), length = cv::norm(normal);
      if (!(area > 0) || !(length > 0)) continue;  // NaN too
      cv::Vec3f& facing = facing_.at<cv::Vec3f>(y, x);
      for (int i = 0; i < 3; ++i)
        facing[i] = static_cast<float>(std::pow(std::abs(normal[i]) / length, facing_power));
      octaves_.at<float>(y, x) = static_cast<float>(0.5 * std::log2(area));
      surface.at<std::uint8_t>(y, x) = 255;
    }
  octaves_.setTo(cv::mean(octaves_, surface)[0], surface == 0);
  cv::medianBlur(octaves_, octaves_, 5);
  cv::GaussianBlur(octaves_, octaves_, {}, 3);
  cv::GaussianBlur(facing_, facing_, {}, 2);
}

cv::Vec3f SurfaceTexture::at(int y, int x, const cv::Mat& texture) const {
  const cv::Vec3f& point = points_.at<cv::Vec3f>(y, x);
  if (!known(point)) return {0, 0, 0};
  const cv::Vec3f& facing = facing_.at<cv::Vec3f>(y, x);
  const float octave = octaves_.at<float>(y, x), lower = std::floor(octave), upper_share = octave - lower;
  const float sum = facing[0] + facing[1] + facing[2];
  cv::Vec3f colours(0, 0, 0);
  float squares = 0;
  for (const float coarser : {0.0f, 1.0f}) {
    const double texel = std::exp2(static_cast<double>(lower + coarser));
    for (int axis = 0; axis < 3; ++axis) {
      const float weight = (coarser > 0 ? upper_share : 1 - upper_share) * facing[axis] / sum;
      if (weight < least_weight) continue;
      // Upright on walls whose up is y or z; shifted, so that the axes do not mirror each other.
      const double u = axis == 0 ? point[2] : point[0], v = axis == 1 ? point[2] : point[1];
      colours += weight * wrapped(texture, u / texel + 37.7 * axis, -v / texel + 91.3 * axis);
      squares += weight * weight;
    }
  }
  return squares > 0 ? colours * (1 / std::sqrt(squares)) : colours;
}

}  // namespace vivant
