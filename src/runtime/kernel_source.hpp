#pragma once
#include <string>

namespace vivant {

/// The text of a kernel file with its includes expanded: from the folder VIVANT_KERNELS where that is set,
/// else the text embedded at build time.
std::string kernel_source(const std::string& file);

}  // namespace vivant
