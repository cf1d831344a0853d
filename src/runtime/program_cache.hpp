#pragma once
#include <optional>
#include <string>
#include <vector>

namespace vivant {

/// Compiled programs on disk, under VIVANT_CACHE or $XDG_CACHE_HOME/vivant or ~/.cache/vivant.
/// Entries are written to a temporary file and renamed; an entry that does not check out is deleted.
class ProgramCache {
 public:
  /// `key` is everything that the binary depends on: source, options, device and driver.
  static std::optional<std::vector<unsigned char>> load(const std::string& key);
  static void store(const std::string& key, const std::vector<unsigned char>& binary);
  static void remove(const std::string& key);
};

}  // namespace vivant
