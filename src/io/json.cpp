#include "vivant/io/json.hpp"

#include <algorithm>

#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

nlohmann::json read_json(const std::filesystem::path& path) {
  const std::string text = read_whole_file(path);
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    const std::size_t end = std::min(text.size(), error.byte > 0 ? error.byte - 1 : 0);
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n');
    // The library's message reads "[...] parse error at line 1, column 2: reason"; the reason is what a
    // reader needs.
    std::string why = error.what();
    const std::size_t colon = why.find(": ");
    if (colon != std::string::npos) why = why.substr(colon + 2);
    fail("{}: line {}: broken JSON: {}", path.string(), line, why);
  }
}

}  // namespace vivant
