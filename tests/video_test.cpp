#include "vivant/io/video.hpp"

#include <cstdlib>

#include "io_helpers.hpp"
#include "vivant/io/atomic_file.hpp"

using namespace vivant;

namespace {

cv::Mat frame_at(cv::Size size, int index) {
  cv::Mat frame(size, CV_8UC3, cv::Scalar(200, 60, 40));
  frame(cv::Rect(0, 0, size.width / 2, size.height)) = cv::Scalar(30, 90, 20 * index);
  return frame;
}

}  // namespace

TEST_CASE("video: frames come back with their colours, at even and odd sizes") {
  const TemporaryFolder folder;
  for (const cv::Size size : {cv::Size(64, 48), cv::Size(63, 47)}) {
    const auto path = folder / "a.mp4";
    VideoWriter writer(path, size, 24);
    for (int i = 0; i < 10; ++i) writer.write(frame_at(size, i));
    CHECK_FALSE(std::filesystem::exists(path));
    writer.close();
    VideoReader reader(path);
    CHECK(reader.fps() == doctest::Approx(24));
    CHECK(reader.size() == cv::Size(64, 48));
    for (int i = 0; i < 10; ++i) {
      const auto frame = reader.next();
      REQUIRE(frame.has_value());
      for (const cv::Point at : {cv::Point(10, 20), cv::Point(50, 20)}) {
        const cv::Vec3i read = frame->at<cv::Vec3b>(at), wanted = frame_at(size, i).at<cv::Vec3b>(at);
        const cv::Vec3i difference = read - wanted;
        CHECK(cv::norm(difference, cv::NORM_INF) <= 8);
      }
    }
    CHECK_FALSE(reader.next().has_value());
    // H.264 with the index ("moov") before the data ("mdat"), so that a browser can start at once.
    const std::string bytes = read_whole_file(path);
    CHECK(contains(bytes, "avc1"));
    CHECK(bytes.find("moov") < bytes.find("mdat"));
    std::filesystem::remove(path);
  }
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("video: an unfinished video leaves nothing, failures give one clear line") {
  const TemporaryFolder folder;
  {
    VideoWriter writer(folder / "a.mp4", {64, 48}, 24);
    writer.write(frame_at({64, 48}, 0));
    CHECK(contains(error_of([&] { writer.write(frame_at({32, 48}, 0)); }), "32x48 in a video of 64x48"));
  }
  CHECK(std::filesystem::is_empty(folder.path()));
  CHECK(contains(error_of([&] { VideoWriter(folder / "none/a.mp4", {64, 48}, 24); }), "cannot write"));
  CHECK(contains(error_of([&] { VideoWriter(folder / "a.mp4", {64, 48}, 0); }), "frame rate"));
  CHECK_THROWS_AS(VideoWriter(folder / "a.avi", {64, 48}, 24), UsageError);
  CHECK(contains(error_of([&] { VideoReader(folder / "none.mp4"); }), "does not exist"));
  write_file(folder / "text.mp4", "not a video");
  CHECK(contains(error_of([&] { VideoReader(folder / "text.mp4"); }), "not a video"));
  const std::string path = std::getenv("PATH");
  setenv("PATH", folder.path().c_str(), 1);
  const std::string error = error_of([&] { VideoWriter(folder / "a.mp4", {64, 48}, 24); });
  setenv("PATH", path.c_str(), 1);
  CHECK(contains(error, "needs the program 'ffmpeg'; install"));
}
