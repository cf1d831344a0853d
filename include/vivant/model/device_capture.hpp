#pragma once
#include <memory>
#include <span>
#include <vector>

#include "vivant/data/capture.hpp"
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Frames of a capture on the device: pictures, cameras and the pixels that may be drawn. All frames have one
/// size. Pixel ids are (frame * height + y) * width + x, the frame counted within this set.
class DeviceCapture {
 public:
  /// `frames`: indices into capture.frames. Throws Error when their sizes differ.
  DeviceCapture(Device& device, const Capture& capture, std::vector<int> frames);

  int width() const { return width_; }
  int height() const { return height_; }
  /// Indices into capture.frames.
  const std::vector<int>& frames() const { return frames_; }

  Value images(Graph& graph) const;   ///< u8 [F H W, 3]
  Value cameras(Graph& graph) const;  ///< camera table of ray_generation

 private:
  int width_ = 0, height_ = 0;
  std::vector<int> frames_;
  std::shared_ptr<Buffer> images_, cameras_;
  std::int64_t camera_numbers_ = 0;
};

/// Pixel ids outside of the person, for the scene: the mask is dilated by `dilation` image heights, as its
/// border and the person's shadow are not background.
std::vector<std::int32_t> background_pixels(const Capture& capture, const std::vector<int>& frames,
                                            double dilation);

}  // namespace vivant
