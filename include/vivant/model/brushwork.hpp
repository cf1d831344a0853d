#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "vivant/model/frame_stylizer.hpp"
#include "vivant/model/surface_texture.hpp"

namespace vivant {

/// The brushwork of a painting where it has one tone: what is finer than a brush there, as a texture.
struct Swatch {
  cv::Vec3f tone;     ///< CIELAB
  cv::Mat strokes;    ///< CV_32FC3 [side, side], of mean 0; it repeats itself
  double rms = 0;     ///< of the strokes
  double weight = 1;  ///< of its painting
};

/// The swatches of a painting (CV_8UC3 RGB): patches of it that have this tone, put together at random (the
/// same ones each time). `brush` is the width of a brush in pixels of the frames that will be painted, to
/// which the painting is brought.
std::vector<Swatch> swatches_of(const cv::Mat& painting, double brush);

/// Lays the brushwork of paintings onto the surfaces that frames show. What a network finds in a painting has
/// contours and colours, but on an even wall no strokes: nothing there says where they would be. Laid onto
/// the surface they stay where they are while the camera moves, and go with the person.
class Brushwork {
 public:
  /// For frames of this size.
  Brushwork(std::span<const StylePicture> paintings, cv::Size frame);

  /// Adds strokes to a stylised picture, CV_32FC3 RGB in [0, 1]: at every pixel those of the tones that it
  /// has, the less the more detail is there already. 1 is as strong as in the painting.
  void lay_onto(cv::Mat& picture, const SurfaceTexture& surfaces, double amount) const;

 private:
  double brush_;
  std::vector<Swatch> swatches_;
};

}  // namespace vivant
