#pragma once
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

namespace vivant {

/// The pictures of a film, CV_8UC3 RGB.
struct Frames {
  std::vector<cv::Mat> pictures;
  double fps = 24;
};

/// Reads a video, or the .png and .jpg files of a folder in the order of their names. Throws Error when there
/// is none, or they have several sizes.
Frames read_frames(const std::filesystem::path& path);

}  // namespace vivant
