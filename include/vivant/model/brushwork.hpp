#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "vivant/model/frame_stylizer.hpp"
#include "vivant/model/surface_texture.hpp"

namespace vivant {

/// The brushwork of a painting where it has one tone, as a texture.
struct Swatch {
  cv::Vec3f tone;          ///< CIELAB
  cv::Mat strokes;         ///< CV_32FC3 [side, side], of mean 0; it repeats itself
  double mean_square = 0;  ///< of the strokes
  double share = 1;        ///< of its painting in a mixture
};

/// The swatches of a painting (CV_8UC3 RGB), by patch-based texture synthesis: what is finer than a Gaussian
/// blur of `brush` texels, in patches that have one tone, put together at random (the same ones each time)
/// and blended where they overlap. The painting is brought to a size at which its strokes suit that.
std::vector<Swatch> swatches_of(const cv::Mat& painting, double brush);

/// Lays the brushwork of paintings onto the surfaces that frames show. What a network finds in a painting has
/// contours and colours, but on an even wall no strokes: nothing there says where they would be. Laid onto
/// the surface they stay where they are while the camera moves, and go with the person.
class Brushwork {
 public:
  /// For frames of this size. Of the paintings' weights only the ratios count; throws as shares_of does.
  Brushwork(std::span<const StylePicture> paintings, cv::Size frame);

  /// A stylised picture, CV_32FC3 RGB, with strokes: at every pixel those of the tones that it has, the less
  /// the more detail is there already; in [0, 1]. An amount of 1 is at most as strong as in the painting.
  /// `by_lightness`: tones are alike when their lightness is. Throws Error for surfaces of another size.
  cv::Mat laid_onto(const cv::Mat& picture, const SurfaceTexture& surfaces, double amount,
                    bool by_lightness = false) const;

 private:
  double brush_;  ///< the Gaussian's sigma in pixels of a frame
  std::vector<Swatch> swatches_;
};

}  // namespace vivant
