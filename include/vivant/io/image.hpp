#pragma once
#include <filesystem>
#include <opencv2/core.hpp>
#include <span>

namespace vivant {

/// All channels of all pixels of a picture in floats. Throws Error when it has other values, or gaps between
/// its rows.
std::span<float> floats_of(cv::Mat& picture);
std::span<const float> floats_of(const cv::Mat& picture);

/// The size of a picture file, checked to be complete without decoding it (PNG and JPEG; others are decoded).
/// Throws Error when the file is missing, not an image, or cut short.
cv::Size inspect_image(const std::filesystem::path& path);

/// Reads a picture as CV_8UC3 in RGB order, pixels as stored (an EXIF orientation is not applied, alpha is
/// dropped). Throws Error when the file is missing, not an image, or cut short.
cv::Mat read_image(const std::filesystem::path& path);

/// The same, but a picture that has alpha as CV_8UC4 in RGBA order.
cv::Mat read_image_with_alpha(const std::filesystem::path& path);

/// Reads a mask as CV_8UC1.
cv::Mat read_mask(const std::filesystem::path& path);

/// Writes CV_8UC3 (RGB), CV_8UC4 (RGBA) or CV_8UC1 atomically; the extension decides the format (.png, .jpg).
void write_image(const std::filesystem::path& path, const cv::Mat& image);

}  // namespace vivant
