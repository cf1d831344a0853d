#pragma once
#include <opencv2/core.hpp>

namespace vivant {

/// A texture that is fixed to the surfaces of a view: it moves with them and shows the same from everywhere.
/// Every point of space has a place on the texture along each of the three axes, of which those that the
/// surface faces count. A texel is about as large as a pixel at any distance: of textures whose texels are
/// powers of two of the points' unit the two around that size are mixed (Benard et al. 2009, "Dynamic solid
/// textures").
class SurfaceTexture {
 public:
  /// The point that each pixel shows, CV_32FC3, in a space in which the surfaces stand still; NaN where there
  /// is none. Steps in depth below those of neighbouring pixels are smoothed.
  explicit SurfaceTexture(const cv::Mat& points);

  /// The colours of a texture at a pixel: CV_32FC3 that repeats itself, of mean 0, whose mean square the
  /// mixture keeps. 0 where there is no surface.
  cv::Vec3f at(int y, int x, const cv::Mat& texture) const;

 private:
  cv::Mat points_;   ///< smoothed
  cv::Mat facing_;   ///< CV_32FC3, how far the surface faces each axis; the sum is 1
  cv::Mat octaves_;  ///< CV_32FC1, log2 of a pixel's size on the surface
};

}  // namespace vivant
