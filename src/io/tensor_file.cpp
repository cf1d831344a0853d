#include "vivant/io/tensor_file.hpp"

#include <fmt/ranges.h>

#include <cmath>

#include "vivant/runtime/error.hpp"

namespace vivant {

const HostTensor& TensorFile::at(const std::string& name) const {
  const auto found = tensors.find(name);
  if (found != tensors.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [key, tensor] : tensors) {
    if (names.size() < 20) names.push_back(key);
  }
  fail("{}: no tensor '{}' (it has: {}{})", source, name, fmt::join(names, ", "),
       tensors.size() > names.size() ? ", ..." : "");
}

const HostTensor& TensorFile::at(const std::string& name, const std::vector<std::int64_t>& shape) const {
  const HostTensor& tensor = at(name);
  bool equal = tensor.shape.size() == shape.size();
  for (std::size_t i = 0; equal && i < shape.size(); ++i)
    equal = shape[i] == -1 || shape[i] == tensor.shape[i];
  if (!equal) {
    std::vector<std::string> wanted;
    for (std::int64_t size : shape) wanted.push_back(size == -1 ? "any" : std::to_string(size));
    fail("{}: tensor '{}' is {}, its shape must be [{}]", source, name, tensor.describe(),
         fmt::join(wanted, ", "));
  }
  return tensor;
}

std::vector<double> TensorFile::finite_doubles(const std::string& name,
                                               const std::vector<std::int64_t>& shape) const {
  std::vector<double> values = at(name, shape).as_doubles();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) fail("{}: tensor '{}' holds {} at element {}", source, name, values[i], i);
  }
  return values;
}

}  // namespace vivant
