#pragma once
#include <string>
#include <utility>

namespace vivant::app {

/// "320x240" as width and height. Throws UsageError for anything else; the job checks the range.
std::pair<int, int> parse_size(const std::string& text);

}  // namespace vivant::app
