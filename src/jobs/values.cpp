#include "vivant/jobs/values.hpp"

#include <charconv>
#include <optional>

#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

/// Two whole numbers around `between`, nothing else.
std::optional<std::pair<int, int>> two_numbers(const std::string& text, char between) {
  const char* const end = text.data() + text.size();
  int first = 0, second = 0;
  const auto [middle, first_error] = std::from_chars(text.data(), end, first);
  if (first_error != std::errc() || middle == end || *middle != between) return std::nullopt;
  const auto [rest, second_error] = std::from_chars(middle + 1, end, second);
  if (second_error != std::errc() || rest != end) return std::nullopt;
  return std::pair(first, second);
}

}  // namespace

std::pair<int, int> size_from(const std::string& text) {
  const auto size = two_numbers(text, 'x');
  if (!size || size->first < 1 || size->second < 1)
    throw UsageError(fmt::format("a size is WIDTHxHEIGHT, such as 320x240, not '{}'", text));
  return *size;
}

std::pair<int, int> frame_range_from(const std::string& text) {
  const auto range = two_numbers(text, ':');
  if (!range || range->first < 0 || range->second <= range->first)
    throw UsageError(fmt::format("frames are FIRST:END, such as 0:24, not '{}'", text));
  return *range;
}

}  // namespace vivant
