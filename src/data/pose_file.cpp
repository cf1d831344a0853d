// load_poses and save_poses: motions as safetensors.
#include <fmt/ranges.h>

#include <charconv>
#include <sstream>

#include "vivant/data/motion.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Vector3d;

namespace {

double parse_fps(const TensorFile& file, const std::string& text) {
  double fps = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), fps);
  if (error != std::errc() || end != text.data() + text.size()) {
    fail("{}: the metadata 'fps' is '{}', a number is needed", file.source, text);
  }
  return fps;
}

}  // namespace

Motion load_poses(const std::filesystem::path& path) {
  const TensorFile file = read_safetensors(path);
  const HostTensor& pose = file.at("pose", {-1, -1, 3});
  const std::int64_t frames = pose.shape[0], joints = pose.shape[1];
  const std::vector<double> rotations = pose.as_doubles();
  const std::vector<double> translations = file.at("trans", {frames, 3}).as_doubles();
  Motion motion;
  if (file.contains("shape")) motion.shape = file.finite_doubles("shape", {-1});
  if (file.metadata.count("fps")) motion.fps = parse_fps(file, file.metadata.at("fps"));
  if (file.metadata.count("joint_names")) {
    std::istringstream names(file.metadata.at("joint_names"));
    for (std::string name; std::getline(names, name, ',');) motion.joint_names.push_back(name);
    if (static_cast<std::int64_t>(motion.joint_names.size()) != joints) {
      fail("{}: the metadata 'joint_names' name {} joints, 'pose' has {}", file.source,
           motion.joint_names.size(), joints);
    }
  }
  for (std::int64_t f = 0; f < frames; ++f) {
    Pose frame(joints);
    for (std::int64_t j = 0; j < joints; ++j) frame[j] = Vector3d(rotations.data() + 3 * (f * joints + j));
    motion.pose.push_back(std::move(frame));
    motion.translation.emplace_back(translations.data() + 3 * f);
  }
  check_motion(motion, static_cast<int>(joints), path.string());
  return motion;
}

void save_poses(const std::filesystem::path& path, const Motion& motion) {
  std::vector<float> rotations, translations;
  for (int f = 0; f < motion.frame_count(); ++f) {
    for (const Vector3d& rotation : motion.pose[f]) {
      for (double value : rotation) rotations.push_back(static_cast<float>(value));
    }
    for (double value : motion.translation[f]) translations.push_back(static_cast<float>(value));
  }
  const std::int64_t frames = motion.frame_count();
  const auto joints = static_cast<std::int64_t>(frames > 0 ? motion.pose[0].size() : 0);
  TensorFile file;
  file.tensors["pose"] = HostTensor({frames, joints, 3}, std::span<const float>(rotations));
  file.tensors["trans"] = HostTensor({frames, 3}, std::span<const float>(translations));
  const std::vector<float> shape(motion.shape.begin(), motion.shape.end());
  if (!shape.empty()) {
    file.tensors["shape"] =
        HostTensor({static_cast<std::int64_t>(shape.size())}, std::span<const float>(shape));
  }
  file.metadata["fps"] = fmt::format("{}", motion.fps);
  if (!motion.joint_names.empty())
    file.metadata["joint_names"] = fmt::format("{}", fmt::join(motion.joint_names, ","));
  write_safetensors(path, file);
}

}  // namespace vivant
