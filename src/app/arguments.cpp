#include "app/arguments.hpp"

#include <charconv>

#include "vivant/runtime/error.hpp"

namespace vivant::app {

std::pair<int, int> parse_size(const std::string& text) {
  const char* const end = text.data() + text.size();
  int width = 0, height = 0;
  const auto [cross, first_error] = std::from_chars(text.data(), end, width);
  if (first_error == std::errc() && cross != end && *cross == 'x') {
    const auto [rest, second_error] = std::from_chars(cross + 1, end, height);
    if (second_error == std::errc() && rest == end && width > 0 && height > 0) return {width, height};
  }
  throw UsageError(fmt::format("a size is WIDTHxHEIGHT, such as 320x240, not '{}'", text));
}

}  // namespace vivant::app
