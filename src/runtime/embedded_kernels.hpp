#pragma once
#include <string_view>
#include <vector>

namespace vivant {

/// One kernel source file, embedded in the binary at build time.
struct EmbeddedFile {
  std::string_view name;
  std::string_view text;
};

const std::vector<EmbeddedFile>& embedded_kernels();

}  // namespace vivant
