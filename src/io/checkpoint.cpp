#include "vivant/io/checkpoint.hpp"

#include <fmt/ranges.h>
#include <zlib.h>

#include <charconv>

#include "vivant/io/safetensors.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

constexpr int format_version = 1;
constexpr const char* advice = "use an older checkpoint of the run, or train it again";

/// CRC-32 over names, types, shapes, values and metadata, so that a flipped bit is found wherever it is.
std::string check_sum(const TensorFile& file) {
  uLong sum = crc32(0, nullptr, 0);
  const auto add = [&](const void* data, std::size_t size) {
    sum = crc32_z(sum, static_cast<const Bytef*>(data), size);
  };
  const auto add_text = [&](const std::string& text) { add(text.c_str(), text.size() + 1); };
  for (const auto& [key, value] : file.metadata) {
    if (key == "check_sum") continue;
    add_text(key);
    add_text(value);
  }
  for (const auto& [name, tensor] : file.tensors) {
    add_text(name);
    add_text(tensor.describe());
    add(tensor.bytes.data(), tensor.bytes.size());
  }
  return fmt::format("{:08x}", sum);
}

std::string text_at(const TensorFile& file, const std::string& key) {
  const auto found = file.metadata.find(key);
  if (found == file.metadata.end()) fail("its metadata lack '{}'", key);
  return found->second;
}

template <typename Number>
Number number_at(const TensorFile& file, const std::string& key) {
  const std::string text = text_at(file, key);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < Number{})
    fail("its {} is '{}', not a whole number", key, text);
  return number;
}

}  // namespace

const HostTensor& Checkpoint::tensor(const std::string& name, const std::vector<std::int64_t>& shape) const {
  const auto found = tensors.find(name);
  if (found == tensors.end())
    fail(
        "{}: the tensor '{}' is missing, which this configuration needs: resume with the config.toml that "
        "the run "
        "was made with",
        source, name);
  if (found->second.shape != shape)
    fail(
        "{}: the tensor '{}' is {}, this configuration needs [{}]: resume with the config.toml that the run "
        "was "
        "made with",
        source, name, found->second.describe(), fmt::join(shape, ", "));
  return found->second;
}

void save_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint) {
  TensorFile file;
  file.tensors = checkpoint.tensors;
  file.metadata = {{"format", "vivant-checkpoint"},
                   {"version", std::to_string(format_version)},
                   {"stage", checkpoint.stage},
                   {"step", std::to_string(checkpoint.step)},
                   {"seed", std::to_string(checkpoint.seed)},
                   {"config", checkpoint.config},
                   {"device_class", checkpoint.device_class},
                   {"precision", checkpoint.precision}};
  file.metadata["check_sum"] = check_sum(file);
  write_safetensors(path, file);
}

Checkpoint load_checkpoint(const std::filesystem::path& path) {
  TensorFile file;
  try {
    file = read_safetensors(path);
  } catch (const Error& error) {
    fail("{}: {}", error.what(), advice);
  }
  try {
    if (text_at(file, "format") != "vivant-checkpoint") fail("it is not a checkpoint");
    const int version = number_at<int>(file, "version");
    if (version != format_version)
      fail("it has version {}, this program reads version {}", version, format_version);
    if (text_at(file, "check_sum") != check_sum(file)) fail("it is damaged (its check sum differs)");
    Checkpoint checkpoint;
    checkpoint.stage = text_at(file, "stage");
    checkpoint.step = number_at<std::int64_t>(file, "step");
    checkpoint.seed = number_at<std::uint64_t>(file, "seed");
    checkpoint.config = text_at(file, "config");
    checkpoint.device_class = text_at(file, "device_class");
    checkpoint.precision = text_at(file, "precision");
    checkpoint.tensors = std::move(file.tensors);
    checkpoint.source = path.string();
    return checkpoint;
  } catch (const Error& error) {
    fail("{}: {}: {}", path.string(), error.what(), advice);
  }
}

}  // namespace vivant
