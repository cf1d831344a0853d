#pragma once
#include <filesystem>
#include <string>

namespace vivant {

/// A file's name and the check sum of its content, so that another content is noticed; "none" without a path.
std::string content_name(const std::filesystem::path& file);

}  // namespace vivant
