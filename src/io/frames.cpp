#include "vivant/io/frames.hpp"

#include <algorithm>

#include "vivant/io/image.hpp"
#include "vivant/io/video.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

Frames read_folder(const std::filesystem::path& path) {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(path))
    if (entry.path().extension() == ".png" || entry.path().extension() == ".jpg")
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  Frames frames;
  for (const std::filesystem::path& file : files) frames.pictures.push_back(read_image(file));
  return frames;
}

Frames read_video(const std::filesystem::path& path) {
  VideoReader video(path);
  Frames frames{{}, video.fps()};
  while (const std::optional<cv::Mat> picture = video.next()) frames.pictures.push_back(*picture);
  return frames;
}

}  // namespace

Frames read_frames(const std::filesystem::path& path) {
  Frames frames = std::filesystem::is_directory(path) ? read_folder(path) : read_video(path);
  if (frames.pictures.empty()) fail("{} holds no pictures", path.string());
  for (const cv::Mat& picture : frames.pictures)
    if (picture.size() != frames.pictures[0].size())
      fail("the pictures of {} have several sizes", path.string());
  return frames;
}

}  // namespace vivant
