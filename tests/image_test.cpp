#include "vivant/io/image.hpp"

#include <opencv2/imgproc.hpp>

#include "io_helpers.hpp"
#include "vivant/io/atomic_file.hpp"

using namespace vivant;

namespace {

cv::Mat pattern(int type) {
  cv::Mat image(37, 53, type);
  cv::RNG random(7);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {5, 5}, 2);
  return image;
}

}  // namespace

TEST_CASE("image: PNG keeps colours in RGB order, JPEG nearly") {
  const TemporaryFolder folder;
  cv::Mat red(8, 9, CV_8UC3, cv::Scalar(250, 10, 20));
  write_image(folder / "red.png", red);
  write_image(folder / "red.jpg", red);
  CHECK(cv::norm(read_image(folder / "red.png"), red, cv::NORM_INF) == 0);
  CHECK(cv::norm(read_image(folder / "red.jpg"), red, cv::NORM_INF) < 8);
  const cv::Mat mask = pattern(CV_8UC1);
  write_image(folder / "mask.png", mask);
  CHECK(cv::norm(read_mask(folder / "mask.png"), mask, cv::NORM_INF) == 0);
  CHECK(inspect_image(folder / "mask.png") == cv::Size(53, 37));
  CHECK(inspect_image(folder / "red.jpg") == cv::Size(9, 8));
  const cv::Mat transparent(4, 5, CV_8UC4, cv::Scalar(1, 2, 3, 128));
  write_image(folder / "rgba.png", transparent);
  CHECK(read_image(folder / "rgba.png").at<cv::Vec3b>(0, 0) == cv::Vec3b(1, 2, 3));
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 4);
}

TEST_CASE("image: a picture cut short anywhere is an error") {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.jpg"}) {
    CAPTURE(name);
    write_image(folder / name, pattern(CV_8UC3));
    const std::string whole = read_whole_file(folder / name);
    for (std::size_t size = 0; size < whole.size(); size += size < 100 || size + 20 > whole.size() ? 1 : 97) {
      write_file(folder / name, whole.substr(0, size));
      CAPTURE(size);
      CHECK_FALSE(error_of([&] { read_image(folder / name); }).empty());
      CHECK_FALSE(error_of([&] { inspect_image(folder / name); }).empty());
    }
    write_file(folder / name, whole + "trailing bytes");
    CHECK(error_of([&] { read_image(folder / name); }).empty());
  }
  write_image(folder / "b.png", pattern(CV_8UC3));
  std::string damaged = read_whole_file(folder / "b.png");
  damaged[damaged.size() / 2] ^= 1;
  write_file(folder / "b.png", damaged);
  CHECK(contains(error_of([&] { read_image(folder / "b.png"); }), "b.png: the image is damaged"));
}

TEST_CASE("image: missing files, other files and bad names give one clear line") {
  const TemporaryFolder folder;
  write_file(folder / "text.png", "this is a text");
  write_file(folder / "empty.png", "");
  CHECK(contains(error_of([&] { read_image(folder / "none.png"); }), "none.png' does not exist"));
  CHECK(contains(error_of([&] { read_image(folder.path()); }), "is a folder"));
  CHECK(contains(error_of([&] { read_image(folder / "text.png"); }), "text.png: not an image"));
  CHECK(contains(error_of([&] { read_mask(folder / "empty.png"); }), "empty.png: the file is empty"));
  CHECK_THROWS_AS(write_image(folder / "a.tga", pattern(CV_8UC3)), UsageError);
  CHECK(contains(error_of([&] { write_image(folder / "none/a.png", pattern(CV_8UC3)); }), "cannot write"));
  CHECK(contains(error_of([&] { write_image(folder / "a.png", cv::Mat(3, 3, CV_32FC3)); }), "8-bit"));
}

TEST_CASE("image: the floats of a picture, which must be floats in one piece") {
  cv::Mat picture(4, 5, CV_32FC3, cv::Scalar(1, 2, 3));
  const cv::Mat& fixed = picture;
  floats_of(picture)[3 * 6 + 1] = 7;
  CHECK(picture.at<cv::Vec3f>(1, 1) == cv::Vec3f(1, 7, 3));
  CHECK(floats_of(fixed).size() == 60);
  CHECK(floats_of(fixed)[19] == 7);
  const cv::Mat part = picture(cv::Rect(1, 1, 2, 2));
  for (const cv::Mat& other : {part, cv::Mat(4, 5, CV_8UC3)})
    CHECK(contains(error_of([&] { floats_of(other); }), "not one piece of floats"));
}
