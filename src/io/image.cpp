#include "vivant/io/image.hpp"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;

namespace {

// Decoders fill what is missing of a truncated picture with grey, so completeness is checked on the file's
// structure.

std::uint32_t big_endian(std::string_view data, std::size_t at, int size) {
  std::uint32_t value = 0;
  for (int i = 0; i < size; ++i) value = value << 8 | static_cast<std::uint8_t>(data[at + i]);
  return value;
}

bool is_png(std::string_view data) { return data.starts_with("\x89PNG\r\n\x1a\n"); }
bool is_jpeg(std::string_view data) { return data.starts_with("\xff\xd8\xff"); }

/// Walks the chunks (length, type, data, checksum) to the end chunk.
cv::Size examine_png(std::string_view data) {
  cv::Size size;
  for (std::size_t at = 8;;) {
    if (data.size() - at < 12) fail("the image is cut short");
    const std::size_t length = big_endian(data, at, 4);
    if (data.size() - at - 12 < length) fail("the image is cut short");
    const std::string_view type = data.substr(at + 4, 4);
    const auto* checked = reinterpret_cast<const Bytef*>(data.data() + at + 4);
    if (crc32_z(0, checked, length + 4) != big_endian(data, at + 8 + length, 4)) fail("the image is damaged");
    if (type == "IHDR" && length >= 8) {
      size = cv::Size(static_cast<int>(big_endian(data, at + 8, 4)),
                      static_cast<int>(big_endian(data, at + 12, 4)));
    }
    if (type == "IEND") return size;
    at += 12 + length;
  }
}

/// Walks the marker segments, and the entropy-coded data behind each start of scan, to the end-of-image
/// marker.
cv::Size examine_jpeg(std::string_view data) {
  cv::Size size;
  std::size_t at = 2;
  const auto byte = [&](std::size_t i) -> int {
    if (i >= data.size()) fail("the image is cut short");
    return static_cast<std::uint8_t>(data[i]);
  };
  for (;;) {
    if (byte(at) != 0xff) fail("the image is damaged");
    while (byte(at) == 0xff) ++at;
    const int marker = byte(at++);
    if (marker == 0xd9) return size;
    if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) continue;
    byte(at + 1);
    const std::size_t length = big_endian(data, at, 2);
    if (length < 2) fail("the image is damaged");
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame && length >= 7) {
      byte(at + 6);
      size = cv::Size(static_cast<int>(big_endian(data, at + 5, 2)),
                      static_cast<int>(big_endian(data, at + 3, 2)));
    }
    at += length;
    if (marker != 0xda) continue;
    // In coded data 0xff is followed by 0 (a stuffed byte) or a restart marker; any other marker ends them.
    while (!(byte(at) == 0xff && byte(at + 1) != 0 && !(byte(at + 1) >= 0xd0 && byte(at + 1) <= 0xd7))) ++at;
  }
}

cv::Mat decode(const std::string& data, int flags) {
  if (data.empty()) fail("the file is empty");
  const cv::Mat bytes(1, static_cast<int>(data.size()), CV_8UC1, const_cast<char*>(data.data()));
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, flags | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    // Reported below, like every other undecodable file.
  }
  if (image.empty()) fail("not an image that can be read (PNG and JPEG work)");
  return image;
}

/// Size of a complete picture; the caller adds the file's name to the message.
cv::Size examine(const std::string& data) {
  cv::Size size;
  if (is_png(data)) {
    size = examine_png(data);
  } else if (is_jpeg(data)) {
    size = examine_jpeg(data);
  } else {
    return decode(data, cv::IMREAD_UNCHANGED).size();
  }
  if (size.width <= 0 || size.height <= 0) fail("the image is damaged: it has no size");
  return size;
}

template <typename Action>
auto naming(const fs::path& path, Action&& action) {
  try {
    return action();
  } catch (const Error& error) {
    fail("{}: {}", path.string(), error.what());
  }
}

cv::Mat read_checked(const fs::path& path, int flags) {
  const std::string data = read_whole_file(path);
  return naming(path, [&] {
    examine(data);
    return decode(data, flags);
  });
}

}  // namespace

std::span<float> floats_of(cv::Mat& picture) {
  if (picture.depth() != CV_32F || !picture.isContinuous()) fail("the picture is not one piece of floats");
  return {picture.ptr<float>(), picture.total() * picture.channels()};
}

std::span<const float> floats_of(const cv::Mat& picture) {
  cv::Mat same = picture;
  return floats_of(same);
}

cv::Size inspect_image(const fs::path& path) {
  const std::string data = read_whole_file(path);
  return naming(path, [&] { return examine(data); });
}

cv::Mat read_image(const fs::path& path) {
  cv::Mat image = read_checked(path, cv::IMREAD_COLOR);
  cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
  return image;
}

cv::Mat read_image_with_alpha(const fs::path& path) {
  cv::Mat image = read_checked(path, cv::IMREAD_UNCHANGED);
  if (image.type() != CV_8UC4) return read_image(path);
  cv::cvtColor(image, image, cv::COLOR_BGRA2RGBA);
  return image;
}

cv::Mat read_mask(const fs::path& path) { return read_checked(path, cv::IMREAD_GRAYSCALE); }

void write_image(const fs::path& path, const cv::Mat& image) {
  cv::Mat ordered;
  if (image.type() == CV_8UC3) {
    cv::cvtColor(image, ordered, cv::COLOR_RGB2BGR);
  } else if (image.type() == CV_8UC4) {
    cv::cvtColor(image, ordered, cv::COLOR_RGBA2BGRA);
  } else if (image.type() == CV_8UC1) {
    ordered = image;
  } else {
    fail("'{}': only 8-bit images of 1, 3 or 4 channels can be written", path.string());
  }
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension != ".png" && extension != ".jpg" && extension != ".jpeg") {
    throw UsageError(fmt::format("'{}': images are written as .png or .jpg", path.string()));
  }
  std::vector<unsigned char> bytes;
  if (ordered.empty() || !cv::imencode(extension, ordered, bytes, {cv::IMWRITE_JPEG_QUALITY, 95})) {
    fail("'{}': the image cannot be encoded", path.string());
  }
  AtomicFile file(path);
  file.write(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace vivant
