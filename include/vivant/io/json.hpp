#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

namespace vivant {

/// Parses a JSON file; throws Error naming file, line and column when it is broken.
nlohmann::json read_json(const std::filesystem::path& path);

}  // namespace vivant
