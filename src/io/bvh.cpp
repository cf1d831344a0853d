#include "vivant/io/bvh.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Words separated by white space, with the line of the last one.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  std::string_view next() {
    skip_space();
    if (text_.empty()) fail("line {}: the file is cut short", line_);
    const std::size_t length = std::min(text_.find_first_of(" \t\r\n"), text_.size());
    const std::string_view word = text_.substr(0, length);
    text_.remove_prefix(length);
    return word;
  }

  void expect(std::string_view wanted) {
    const std::string_view word = next();
    if (word != wanted) fail("line {}: '{}' is expected, not '{}'", line_, wanted, word);
  }

  double number() {
    const std::string word(next());
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    if (*end != '\0' || !std::isfinite(value)) fail("line {}: '{}' is not a finite number", line_, word);
    return value;
  }

  int count(int limit) {
    const double value = number();
    if (value < 0 || value > limit || value != std::floor(value))
      fail("line {}: {} is not a possible count", line_, value);
    return static_cast<int>(value);
  }

  std::size_t characters_left() const { return text_.size(); }
  int line() const { return line_; }

 private:
  void skip_space() {
    const std::size_t start = std::min(text_.find_first_not_of(" \t\r\n"), text_.size());
    line_ +=
        static_cast<int>(std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(start), '\n'));
    text_.remove_prefix(start);
  }

  std::string_view text_;
  int line_ = 1;
};

struct Channel {
  int joint;
  int axis;  // 0 x, 1 y, 2 z
  bool rotation;
};

Channel parse_channel(Words& words, int joint) {
  const std::string_view name = words.next();
  const bool rotation = name.size() == 9 && name.substr(1) == "rotation";
  const bool position = name.size() == 9 && name.substr(1) == "position";
  if ((!rotation && !position) || name[0] < 'X' || name[0] > 'Z')
    fail("line {}: unknown channel '{}'", words.line(), name);
  return {joint, name[0] - 'X', rotation};
}

Vector3d parse_offset(Words& words) {
  words.expect("OFFSET");
  const double x = words.number(), y = words.number();
  return {x, y, words.number()};
}

/// The joint whose name comes next, and its children.
void parse_joint(Words& words, int parent, SkeletonMotion& motion, std::vector<Channel>& channels) {
  const int joint = static_cast<int>(motion.joint_names.size());
  if (joint >= 10000) fail("line {}: more than 10000 joints", words.line());
  motion.joint_names.emplace_back(words.next());
  motion.parents.push_back(parent);
  words.expect("{");
  const Vector3d offset = parse_offset(words);
  motion.rest_positions.push_back(parent < 0 ? offset : Vector3d(motion.rest_positions[parent] + offset));
  for (std::string_view word = words.next(); word != "}"; word = words.next()) {
    if (word == "CHANNELS") {
      const int count = words.count(6);
      for (int i = 0; i < count; ++i) channels.push_back(parse_channel(words, joint));
    } else if (word == "JOINT") {
      parse_joint(words, joint, motion, channels);
    } else if (word == "End") {
      words.expect("Site");
      words.expect("{");
      parse_offset(words);
      words.expect("}");
    } else {
      fail("line {}: unknown word '{}'", words.line(), word);
    }
  }
}

Matrix3d axis_rotation(int axis, double degrees) {
  const double angle = degrees * M_PI / 180, c = std::cos(angle), s = std::sin(angle);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  Matrix3d rotation = Matrix3d::Identity();
  rotation(u, u) = rotation(v, v) = c;
  rotation(v, u) = s;
  rotation(u, v) = -s;
  return rotation;
}

SkeletonMotion parse(std::string_view text) {
  Words words(text);
  SkeletonMotion motion;
  std::vector<Channel> channels;
  words.expect("HIERARCHY");
  words.expect("ROOT");
  parse_joint(words, -1, motion, channels);
  words.expect("MOTION");
  words.expect("Frames:");
  const int frames = words.count(10'000'000);
  words.expect("Frame");
  words.expect("Time:");
  const double seconds = words.number();
  if (frames < 1) fail("line {}: no frames", words.line());
  if (!(seconds > 0)) fail("line {}: a frame time of {} s is not possible", words.line(), seconds);
  motion.fps = 1 / seconds;
  // Every value takes two characters at least: a larger count is broken, not worth the memory.
  if (frames * std::max<std::size_t>(1, channels.size()) > words.characters_left()) {
    fail("line {}: the file is cut short, it promises {} frames", words.line(), frames);
  }
  for (int frame = 0; frame < frames; ++frame) {
    std::vector<Matrix3d> rotations(motion.joint_names.size(), Matrix3d::Identity());
    Vector3d root = motion.rest_positions[0];
    for (const Channel& channel : channels) {
      const double value = words.number();
      if (channel.rotation) {
        rotations[channel.joint] = rotations[channel.joint] * axis_rotation(channel.axis, value);
      } else if (channel.joint == 0) {
        root[channel.axis] = value;
      }
    }
    motion.rotations.push_back(std::move(rotations));
    motion.root_positions.push_back(root);
  }
  return motion;
}

}  // namespace

int SkeletonMotion::find_joint(const std::string& name) const {
  const auto found = std::find(joint_names.begin(), joint_names.end(), name);
  return found == joint_names.end() ? -1 : static_cast<int>(found - joint_names.begin());
}

SkeletonMotion read_bvh(const std::filesystem::path& path) {
  const std::string text = read_whole_file(path);
  try {
    return parse(text);
  } catch (const Error& error) {
    fail("{}: {}", path.string(), error.what());
  }
}

}  // namespace vivant
