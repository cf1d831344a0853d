#pragma once
#include <sys/types.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>

namespace vivant {

/// Writes an MP4 video that browsers play: H.264, yuv420p, index in front. The frames go through a pipe to
/// the program `ffmpeg`. The file has a temporary name until close(); without close() it is removed.
class VideoWriter {
 public:
  /// Throws Error when ffmpeg is not installed or the folder cannot be written. Odd sizes are padded by
  /// repeating the last row or column, which H.264 needs.
  VideoWriter(std::filesystem::path path, cv::Size size, double fps);
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;
  ~VideoWriter();

  /// Adds a frame: CV_8UC3, RGB, of the size given at the start.
  void write(const cv::Mat& frame);
  /// Finishes the file and gives it its name.
  void close();

 private:
  /// Ends the pipe and waits for ffmpeg; whether it succeeded.
  bool finish();
  [[noreturn]] void fail_with_log();

  std::filesystem::path path_, temporary_;
  cv::Size size_;
  pid_t process_ = -1;
  int pipe_ = -1;
  int log_ = -1;
};

/// Reads a video frame by frame.
class VideoReader {
 public:
  /// Throws Error when the file is missing or not a video.
  explicit VideoReader(const std::filesystem::path& path);
  double fps() const { return fps_; }
  cv::Size size() const { return size_; }
  /// The next frame (CV_8UC3, RGB); none at the end.
  std::optional<cv::Mat> next();

 private:
  cv::VideoCapture capture_;
  double fps_ = 0;
  cv::Size size_;
};

}  // namespace vivant
