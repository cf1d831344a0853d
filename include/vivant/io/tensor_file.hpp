#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "vivant/io/host_tensor.hpp"

namespace vivant {

/// Named tensors and string metadata: the content of a .safetensors or .npz file.
struct TensorFile {
  std::map<std::string, HostTensor> tensors;
  std::map<std::string, std::string> metadata;
  std::string source;  ///< the file that was read, for messages

  bool contains(const std::string& name) const { return tensors.count(name) != 0; }
  /// The tensor called `name`; throws Error naming the file and the tensors that it has.
  const HostTensor& at(const std::string& name) const;
  /// The same, checked against `shape`; -1 stands for any size.
  const HostTensor& at(const std::string& name, const std::vector<std::int64_t>& shape) const;
  /// The values of `name` as doubles, all of them finite; throws Error naming the file, the tensor and the
  /// index.
  std::vector<double> finite_doubles(const std::string& name, const std::vector<std::int64_t>& shape) const;
};

}  // namespace vivant
