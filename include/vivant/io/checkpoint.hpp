#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "vivant/io/tensor_file.hpp"

namespace vivant {

/// The state of a training run: all that is needed to go on with the same bits. docs/checkpoint-format.md
/// describes the file.
struct Checkpoint {
  std::string stage;         ///< "reconstruct", "features" or "style"
  std::int64_t step = 0;     ///< steps done in this stage
  std::uint64_t seed = 0;    ///< of all random numbers
  std::string config;        ///< the run's configuration as TOML
  std::string device_class;  ///< "cpu" or "gpu": which form of the kernels computed
  std::string precision;     ///< the arithmetic mode: "single"
  /// By name: parameter/NAME, adam_m/NAME, adam_v/NAME (moments), state/NAME (running statistics, codebooks).
  std::map<std::string, HostTensor> tensors;
  std::string source;  ///< the file it was loaded from, for messages

  /// The tensor `name`; throws, naming the file and what to do, when it is missing or has another shape.
  const HostTensor& tensor(const std::string& name, const std::vector<std::int64_t>& shape) const;
};

/// Writes atomically, with a check sum over everything.
void save_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);

/// Loads and checks a checkpoint. Throws one line, naming the file and what to do, when it is cut short,
/// damaged, of a newer version or no checkpoint.
Checkpoint load_checkpoint(const std::filesystem::path& path);

}  // namespace vivant
