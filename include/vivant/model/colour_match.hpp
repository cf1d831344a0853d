#pragma once
#include <Eigen/Core>
#include <span>

namespace vivant {

/// Mean and covariance of the colours of a picture.
class ColourStatistics {
 public:
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  /// Takes in more pixels [n, 3].
  void add(std::span<const float> pixels);

 private:
  double count_ = 0;
};

/// colour -> matrix * colour + offset.
struct ColourTransform {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();

  /// From none of it (0) to all (1).
  ColourTransform blended(double amount) const;
  /// Applies it to pixels [n, 3] in place and clamps them to [0, 1].
  void apply(std::span<float> pixels) const;
};

/// The linear map between two Gaussians that moves colours least (Monge-Kantorovich; Pitie and Kokaram 2007):
/// A^-1/2 (A^1/2 B A^1/2)^1/2 A^-1/2 for covariances A of `from` and B of `to`. Its eigenvalues are clamped
/// to [0.5, 1.5], so that flat pictures are not torn apart.
ColourTransform match_colours(const ColourStatistics& from, const ColourStatistics& to);

/// The luma of `light` with the chroma of `colours`, both pixels [n, 3]: `light` becomes it. Where a colour
/// would leave [0, 1] it is drawn towards grey, so that luma and hue stay.
void take_chroma(std::span<float> light, std::span<const float> colours);

}  // namespace vivant
