#pragma once
#include <toml++/toml.h>

#include <string>

namespace vivant {

/// A TOML text as a table. Throws UsageError naming `source` and line, in one line.
toml::table parse_toml(const std::string& text, const std::string& source);

/// A value as it would be written.
std::string text_of(const toml::node& node);

/// "jobs.toml line 3".
std::string line_of(const toml::node& node, const std::string& source);

}  // namespace vivant
