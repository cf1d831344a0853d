#include "jobs/toml_text.hpp"

#include <algorithm>
#include <sstream>

#include "vivant/runtime/error.hpp"

namespace vivant {

toml::table parse_toml(const std::string& text, const std::string& source) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    std::string why(error.description());  // of several lines
    std::replace(why.begin(), why.end(), '\n', ' ');
    throw UsageError(fmt::format("{} line {}: broken TOML: {}", source, error.source().begin.line, why));
  }
}

std::string text_of(const toml::node& node) {
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

std::string line_of(const toml::node& node, const std::string& source) {
  return fmt::format("{} line {}", source, node.source().begin.line);
}

}  // namespace vivant
