#include "vivant/model/colour_match.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace vivant {
namespace {

constexpr double smallest_stretch = 0.5, largest_stretch = 1.5;
constexpr double ridge = 1e-6;  // of variances of colours in [0, 1]

/// The symmetric matrix with each eigenvalue replaced by f of it.
template <typename F>
Eigen::Matrix3d with_eigenvalues(const Eigen::Matrix3d& symmetric, F f) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(symmetric);
  return solver.eigenvectors() * solver.eigenvalues().unaryExpr(f).asDiagonal() *
         solver.eigenvectors().transpose();
}

Eigen::Matrix3d square_root(const Eigen::Matrix3d& symmetric) {
  return with_eigenvalues(symmetric, [](double value) { return std::sqrt(std::max(value, 0.0)); });
}

}  // namespace

void ColourStatistics::add(std::span<const float> pixels) {
  const auto count = static_cast<Eigen::Index>(pixels.size() / 3);
  const Eigen::Matrix<double, 3, Eigen::Dynamic> colours =
      Eigen::Map<const Eigen::Matrix<float, 3, Eigen::Dynamic>>(pixels.data(), 3, count).cast<double>();
  const Eigen::Vector3d new_mean = colours.rowwise().mean();
  const Eigen::Matrix<double, 3, Eigen::Dynamic> centred = colours.colwise() - new_mean;
  const double total = count_ + static_cast<double>(count), part = static_cast<double>(count) / total;
  const Eigen::Vector3d difference = new_mean - mean;
  covariance = (1 - part) * covariance + centred * centred.transpose() / total +
               part * (1 - part) * difference * difference.transpose();
  mean += part * difference;
  count_ = total;
}

ColourTransform ColourTransform::blended(double amount) const {
  return {amount * matrix + (1 - amount) * Eigen::Matrix3d::Identity(), amount * offset};
}

void ColourTransform::apply(std::span<float> pixels) const {
  const Eigen::Matrix3f a = matrix.cast<float>();
  const Eigen::Vector3f b = offset.cast<float>();
  Eigen::Map<Eigen::Matrix<float, 3, Eigen::Dynamic>> all(pixels.data(), 3,
                                                          static_cast<Eigen::Index>(pixels.size() / 3));
  all = ((a * all).colwise() + b).cwiseMax(0.0f).cwiseMin(1.0f).eval();
}

ColourTransform match_colours(const ColourStatistics& from, const ColourStatistics& to) {
  const Eigen::Matrix3d source = from.covariance + ridge * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d root = square_root(source), inverse = root.inverse();
  const Eigen::Matrix3d map = inverse * square_root(root * to.covariance * root) * inverse;
  const Eigen::Matrix3d stretch = with_eigenvalues(
      map, [](double value) { return std::clamp(value, smallest_stretch, largest_stretch); });
  return {stretch, to.mean - stretch * from.mean};
}

void take_chroma(std::span<float> light, std::span<const float> colours) {
  const Eigen::Vector3f weights(0.299f, 0.587f, 0.114f);
  for (std::size_t i = 0; i + 2 < light.size(); i += 3) {
    Eigen::Map<Eigen::Vector3f> pixel(&light[i]);
    const Eigen::Vector3f colour =
        Eigen::Map<const Eigen::Vector3f>(&colours[i]).cwiseMax(0.0f).cwiseMin(1.0f);
    const float luma = std::clamp(weights.dot(pixel), 0.0f, 1.0f);
    const Eigen::Vector3f chroma = colour.array() - weights.dot(colour);
    float kept = 1;
    for (int c = 0; c < 3; ++c) {
      if (chroma[c] > 0) kept = std::min(kept, (1 - luma) / chroma[c]);
      if (chroma[c] < 0) kept = std::min(kept, -luma / chroma[c]);
    }
    pixel = (kept * chroma).array() + luma;
  }
}

}  // namespace vivant
