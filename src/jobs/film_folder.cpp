#include "jobs/film_folder.hpp"

#include <cmath>

#include "vivant/io/atomic_file.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/json.hpp"
#include "vivant/io/video.hpp"
#include "vivant/jobs/film_renderer.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;

namespace {

/// The picture over grey where it is transparent.
cv::Mat opaque(const cv::Mat& picture) {
  if (picture.type() == CV_8UC3) return picture;
  cv::Mat result(picture.size(), CV_8UC3);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      const cv::Vec4b& from = picture.at<cv::Vec4b>(y, x);
      const double alpha = from[3] / 255.0;
      for (int c = 0; c < 3; ++c)
        result.at<cv::Vec3b>(y, x)[c] =
            cv::saturate_cast<std::uint8_t>(alpha * from[c] + (1 - alpha) * 255 * film_grey);
    }
  return result;
}

/// Hidden ones do not count: they are what a killed program was writing.
bool holds_files(const fs::path& folder) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (!entry.path().filename().string().starts_with('.')) return true;
  return false;
}

void check_settings(const fs::path& folder, const nlohmann::json& before, const nlohmann::ordered_json& now) {
  for (const auto& [key, value] : now.items()) {
    const nlohmann::json was = before.is_object() ? before.value(key, nlohmann::json()) : nlohmann::json();
    if (was != nlohmann::json(value))
      fail("{} holds pictures made with other settings ({} was {}, now {}): delete it or give another output",
           folder.string(), key, was.dump(), value.dump());
  }
}

}  // namespace

FilmFolder::FilmFolder(fs::path folder, const nlohmann::ordered_json& settings) : folder_(std::move(folder)) {
  const fs::path file = folder_ / "film.json";
  if (fs::exists(file)) {
    check_settings(folder_, read_json(file), settings);
    return;
  }
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) fail("cannot make the folder {}: {}", folder_.string(), error.message());
  if (holds_files(folder_))
    fail("{} is not empty and holds no film.json: give another output", folder_.string());
  fs::remove(film());  // of other pictures
  write_text_file(file, settings.dump(1) + "\n");
}

fs::path FilmFolder::picture(int frame) const { return folder_ / fmt::format("{:04}.png", frame); }

fs::path FilmFolder::film() const { return fs::path(folder_).concat(".mp4"); }

void FilmFolder::write_film(int count, double fps) const {
  std::optional<VideoWriter> video;
  for (int frame = 0; frame < count; ++frame) {
    const cv::Mat picture = opaque(read_image_with_alpha(this->picture(frame)));
    if (!video) video.emplace(film(), picture.size(), fps);
    video->write(picture);
  }
  video->close();
}

}  // namespace vivant
