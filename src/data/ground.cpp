#include "vivant/data/ground.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace vivant {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr int rounds = 30;              // of the weights; they settle within ten
constexpr double jump = 0.05;           // metres off the plane at which a point counts half
constexpr double level = 0.05;          // square metres: the variance of feet's places that halves a slope
constexpr double below_floor = 0.05;    // of the frames: fits that sink too deep
constexpr double most_slope = 0.36397;  // tan 20 degrees

/// y = height + slope . (x, z)
struct Slope {
  Vector2d slope = Vector2d::Zero();
  double height = 0;
  double above(const Vector3d& p) const { return p.y() - height - slope.dot(Vector2d(p.x(), p.z())); }
};

Slope weighted_fit(const std::vector<Vector3d>& points, const std::vector<double>& weights) {
  Vector3d mean = Vector3d::Zero();
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    mean += weights[i] * points[i];
    sum += weights[i];
  }
  mean /= sum;
  Matrix2d square = level * Matrix2d::Identity();
  Vector2d product = Vector2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d d = points[i] - mean;
    const Vector2d flat(d.x(), d.z());
    square += weights[i] / sum * flat * flat.transpose();
    product += weights[i] / sum * d.y() * flat;
  }
  Slope fit;
  fit.slope = square.ldlt().solve(product);
  fit.height = mean.y() - fit.slope.dot(Vector2d(mean.x(), mean.z()));
  return fit;
}

}  // namespace

std::vector<Vector3d> lowest_points(const Body& body, const Motion& motion) {
  std::vector<Vector3d> lowest;
  for (int frame = 0; frame < motion.frame_count(); ++frame) {
    const std::vector<Vector3d> posed = posed_vertices(body, motion, frame);
    lowest.push_back(*std::min_element(posed.begin(), posed.end(),
                                       [](const Vector3d& a, const Vector3d& b) { return a.y() < b.y(); }));
  }
  return lowest;
}

std::optional<GroundPlane> fitted_ground(const Body& body, const Motion& motion) {
  const std::vector<Vector3d> points = lowest_points(body, motion);
  std::vector<double> weights(points.size(), 1.0);
  Slope fit;
  for (int round = 0; round < rounds; ++round) {
    fit = weighted_fit(points, weights);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double off = fit.above(points[i]) / jump;
      weights[i] = 1 / (1 + off * off);
    }
  }
  if (fit.slope.norm() > most_slope) return std::nullopt;
  GroundPlane ground;
  ground.normal = Vector3d(-fit.slope.x(), 1, -fit.slope.y()).normalized();
  std::vector<double> heights;
  heights.reserve(points.size());
  for (const Vector3d& point : points) heights.push_back(ground.normal.dot(point));
  const auto low = heights.begin() + static_cast<std::ptrdiff_t>(below_floor * (heights.size() - 1.0));
  std::nth_element(heights.begin(), low, heights.end());
  ground.offset = *low;
  return ground;
}

}  // namespace vivant
