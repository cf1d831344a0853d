#include "jobs/training_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

#include "vivant/io/image.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

const std::set<std::string> picture_extensions = {".jpg", ".jpeg", ".png", ".webp", ".bmp", ".tif", ".tiff"};

bool starts_with_one_of(const std::filesystem::path& path, const std::vector<std::string>& starts) {
  const std::string name = path.filename().string();
  return std::any_of(starts.begin(), starts.end(), [&](auto& start) { return name.starts_with(start); });
}

/// A picture as CV_32FC3 RGB in [0,1] whose short side is `side`.
cv::Mat picture_with_side(const cv::Mat& rgb8, int side) {
  const double factor = static_cast<double>(side) / std::min(rgb8.rows, rgb8.cols);
  cv::Mat result;
  rgb8.convertTo(result, CV_32F, 1.0 / 255);
  if (factor != 1)
    cv::resize(result, result,
               {static_cast<int>(std::lround(rgb8.cols * factor)),
                static_cast<int>(std::lround(rgb8.rows * factor))},
               0, 0, factor < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  return cv::min(cv::max(result, 0.0), 1.0);
}

/// Channels permuted or inverted, gamma, and a mix with a random grey: other colours, the same shapes.
void change_colours(cv::Mat& picture, KeyedRandom& random) {
  const double kind = random.uniform();
  if (kind < 0.5) {
    constexpr int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    const int* order = orders[random.below(6)];
    const int pairs[] = {0, order[0], 1, order[1], 2, order[2]};
    cv::Mat mixed(picture.size(), picture.type());
    cv::mixChannels(&picture, 1, &mixed, 1, pairs, 3);
    picture = mixed;
  } else if (kind < 0.7) {
    picture = cv::Scalar::all(1) - picture;
  }
  cv::pow(cv::max(picture, 0.0), std::exp(random.uniform(-0.4, 0.4)), picture);
  cv::Scalar gain, shift;
  for (int c = 0; c < 3; ++c) {
    gain[c] = random.uniform(0.7, 1.1);
    shift[c] = (1 - gain[c]) * random.uniform(0, 0.6);
  }
  cv::multiply(picture, gain, picture);
  cv::add(picture, shift, picture);
}

}  // namespace

std::vector<std::filesystem::path> pictures_below(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) fail("'{}' is not a folder of pictures", folder.string());
  std::vector<std::filesystem::path> found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(), ::tolower);
    if (entry.is_regular_file() && picture_extensions.count(extension)) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

KeyedRandom::KeyedRandom(std::uint64_t seed, const std::string& stage, std::int64_t step) {
  state_ = 14695981039346656037ull ^ seed;  // FNV-1a
  for (const char c : stage) state_ = (state_ ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  state_ = (state_ ^ static_cast<std::uint64_t>(step)) * 1099511628211ull;
  next();
}

std::uint64_t KeyedRandom::next() {  // SplitMix64
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

double KeyedRandom::uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53;
}

std::int64_t KeyedRandom::below(std::int64_t end) {
  return std::min(end - 1, static_cast<std::int64_t>(uniform() * static_cast<double>(end)));
}

void KeyedRandom::fill_normal(std::vector<float>& values, double deviation) {
  // The sum of four 16-bit numbers: close to normal, and one draw each.
  const double scale = deviation * std::sqrt(3.0) / 65536;
  for (float& value : values) {
    const std::uint64_t bits = next();
    const auto sum = static_cast<std::int64_t>((bits & 0xffff) + (bits >> 16 & 0xffff) +
                                               (bits >> 32 & 0xffff) + (bits >> 48));
    value = static_cast<float>(scale * static_cast<double>(sum - 131070));
  }
}

TrainingPictures::TrainingPictures(const std::vector<std::filesystem::path>& folders, int short_side,
                                   int least_side, const std::vector<std::string>& left_out) {
  for (const auto& folder : folders)
    for (const auto& path : pictures_below(folder)) {
      if (starts_with_one_of(path, left_out)) continue;
      const cv::Mat picture = read_image(path);
      const int side = std::min(picture.rows, picture.cols);
      if (side < least_side) continue;
      pictures_.push_back(picture_with_side(picture, std::min(side, short_side)));
    }
  if (pictures_.empty())
    fail("no picture of {} pixels or more in {}: name a folder with photographs or paintings", least_side,
         folders.empty() ? std::string("no folder") : "'" + folders.front().string() + "'");
}

cv::Mat TrainingPictures::crop(KeyedRandom& random, int side, double recolour) const {
  const cv::Mat& picture = pictures_[random.below(static_cast<std::int64_t>(pictures_.size()))];
  const int shortest = std::min(picture.rows, picture.cols);
  const int cut = std::max(static_cast<int>(shortest * random.uniform(0.5, 1)), std::min(side, shortest));
  const auto top = static_cast<int>(random.below(picture.rows - cut + 1)),
             left = static_cast<int>(random.below(picture.cols - cut + 1));
  cv::Mat result;
  cv::resize(picture(cv::Rect(left, top, cut, cut)), result, {side, side}, 0, 0,
             cut > side ? cv::INTER_AREA : cv::INTER_CUBIC);
  if (random.chance(0.5)) cv::flip(result, result, 1);
  if (random.chance(recolour)) change_colours(result, random);
  return cv::min(cv::max(result, 0.0), 1.0);
}

std::vector<cv::Mat> pictures_called(const std::vector<std::filesystem::path>& folders,
                                     const std::vector<std::string>& starts, int short_side) {
  std::vector<cv::Mat> found;
  for (const auto& folder : folders)
    for (const auto& path : pictures_below(folder))
      if (starts_with_one_of(path, starts)) found.push_back(picture_with_side(read_image(path), short_side));
  return found;
}

}  // namespace vivant
