#include "vivant/model/device_capture.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vivant/data/camera_table.hpp"

namespace vivant {

DeviceCapture::DeviceCapture(Device& device, const Capture& capture, std::vector<int> frames)
    : frames_(std::move(frames)) {
  if (frames_.empty()) fail("{}: no frames are left to train on", capture.source.string());
  width_ = capture.frames[frames_.front()].camera.width;
  height_ = capture.frames[frames_.front()].camera.height;
  const std::size_t image_bytes = static_cast<std::size_t>(width_) * height_ * 3;
  images_ = std::make_shared<Buffer>(device.allocate(image_bytes * frames_.size()));
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const CaptureFrame& frame = capture.frames[frames_[i]];
    if (frame.camera.width != width_ || frame.camera.height != height_)
      fail("{}: {} has {}x{} pixels, other frames {}x{}: make all frames one size", capture.source.string(),
           frame.name, frame.camera.width, frame.camera.height, width_, height_);
    const cv::Mat image = capture.image(frames_[i]);
    device.write(*images_, image.data, image_bytes, i * image_bytes);
    cameras.push_back(frame.camera);
  }
  const std::vector<float> table = camera_table(cameras);
  camera_numbers_ = static_cast<std::int64_t>(table.size() / cameras.size());
  cameras_ = std::make_shared<Buffer>(device.allocate(table.size() * sizeof(float)));
  device.write(*cameras_, table.data(), table.size() * sizeof(float));
}

Value DeviceCapture::images(Graph& graph) const {
  const std::int64_t pixels = static_cast<std::int64_t>(frames_.size()) * width_ * height_;
  return graph.named("images", [&] {
    return graph.external("images", {DType::u8, {pixels, 3}}, {images_, 0});
  });
}

Value DeviceCapture::cameras(Graph& graph) const {
  return graph.named("cameras", [&] {
    return graph.external("cameras",
                          {DType::real, {static_cast<std::int64_t>(frames_.size()), camera_numbers_}},
                          {cameras_, 0});
  });
}

std::vector<std::int32_t> background_pixels(const Capture& capture, const std::vector<int>& frames,
                                            double dilation) {
  std::vector<std::int32_t> pixels;
  std::int32_t id = 0;
  for (const int frame : frames) {
    cv::Mat mask = capture.mask(frame);
    const int radius = static_cast<int>(std::lround(dilation * mask.rows));
    if (radius > 0)
      cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1}));
    for (int y = 0; y < mask.rows; ++y)
      for (int x = 0; x < mask.cols; ++x, ++id)
        if (mask.at<std::uint8_t>(y, x) < 128) pixels.push_back(id);
  }
  if (pixels.empty()) fail("{}: the masks leave no pixel of the background", capture.source.string());
  return pixels;
}

}  // namespace vivant
