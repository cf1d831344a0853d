#pragma once
#include <string>
#include <utility>

namespace vivant {

// Values as a user writes them, on the command line and in files. Each throws UsageError saying which form it
// wants.

/// "320x240" as width and height, both positive.
std::pair<int, int> size_from(const std::string& text);
/// "10:20" as the range [10, 20).
std::pair<int, int> frame_range_from(const std::string& text);

}  // namespace vivant
