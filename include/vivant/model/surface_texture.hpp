#pragma once
#include <opencv2/core.hpp>
#include <vector>

namespace vivant {

/// Triplanar mapping of textures onto the surfaces of a view, where they stay when the camera moves: every
/// point of space has a place on the texture along each of the three axes, of which those that the surface
/// faces count. A texel has about `texel` pixels at any distance: of textures whose texels are powers of
/// two of the points' unit the two around that size are mixed (Benard et al. 2009, "Dynamic solid textures").
class SurfaceTexture {
 public:
  /// The point that each pixel shows, CV_32FC3, in a space in which the surfaces stand still; NaN where there
  /// is none. Noise in it is smoothed, but not over edges.
  explicit SurfaceTexture(const cv::Mat& points);

  /// A place on a texture, in texels, and its share of the pixel.
  struct Place {
    double u, v;
    float weight;
  };
  /// The places of a pixel, at most six, whose squared weights sum up to 1; none where there is no surface.
  std::vector<Place> places(int y, int x) const;
  cv::Size size() const { return points_.size(); }
  static constexpr double texel = 1.4;  ///< pixels: finer ones flicker

 private:
  cv::Mat points_;   ///< smoothed; NaN where the others mean nothing
  cv::Mat facing_;   ///< CV_32FC3, how far the surface faces each axis; the sum is 1
  cv::Mat octaves_;  ///< CV_32FC1, log2 of a texel's size on the surface
};

/// The mixture of the colours that a texture has at the places: CV_32FC3 of mean 0, whose mean square the
/// mixture keeps. It repeats itself.
cv::Vec3f look_up(const cv::Mat& texture, const std::vector<SurfaceTexture::Place>& places);

}  // namespace vivant
