#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vivant {

/// Where what was found out about devices is kept: VIVANT_CACHE or $XDG_CACHE_HOME/vivant or ~/.cache/vivant.
std::filesystem::path cache_folder();
/// The same for every build, so that names of files survive a new compiler.
std::uint64_t stable_hash(const std::string& text, std::uint64_t seed = 0);

/// Compiled programs on disk, in the cache folder.
/// Entries are written to a temporary file and renamed; an entry that does not check out is deleted.
class ProgramCache {
 public:
  /// `key` is everything that the binary depends on: source, options, device and driver.
  static std::optional<std::vector<unsigned char>> load(const std::string& key);
  static void store(const std::string& key, const std::vector<unsigned char>& binary);
  static void remove(const std::string& key);
};

}  // namespace vivant
