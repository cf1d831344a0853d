#include "runtime/program_cache.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

namespace vivant {
namespace {

namespace fs = std::filesystem;

constexpr char magic[8] = {'v', 'i', 'v', 'a', 'n', 't', '0', '1'};

// FNV-1a: a stable 64-bit hash, so that file names and check sums survive a new compiler.
std::uint64_t hash(const void* data, std::size_t bytes, std::uint64_t seed) {
  std::uint64_t value = 14695981039346656037ull ^ seed;
  for (std::size_t i = 0; i < bytes; ++i)
    value = (value ^ static_cast<const unsigned char*>(data)[i]) * 1099511628211ull;
  return value;
}

/// The value of an environment variable; an empty one counts as not set.
const char* variable(const char* name) {
  const char* value = std::getenv(name);
  return value && *value ? value : nullptr;
}

fs::path file_of(const std::string& key) {
  return cache_folder() / fmt::format("{:016x}{:016x}.bin", stable_hash(key), stable_hash(key, 77));
}

}  // namespace

fs::path cache_folder() {
  if (const char* path = variable("VIVANT_CACHE")) return path;
  if (const char* path = variable("XDG_CACHE_HOME")) return fs::path(path) / "vivant";
  if (const char* path = variable("HOME")) return fs::path(path) / ".cache" / "vivant";
  return fs::temp_directory_path() / "vivant-cache";
}

std::uint64_t stable_hash(const std::string& text, std::uint64_t seed) {
  return hash(text.data(), text.size(), seed);
}

std::optional<std::vector<unsigned char>> ProgramCache::load(const std::string& key) {
  std::ifstream in(file_of(key), std::ios::binary);
  if (!in) return std::nullopt;
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  std::uint64_t sum = 0;
  if (text.size() < sizeof(magic) + sizeof(sum) || std::memcmp(text.data(), magic, sizeof(magic)) != 0) {
    remove(key);
    return std::nullopt;
  }
  std::memcpy(&sum, text.data() + sizeof(magic), sizeof(sum));
  const std::string_view body(text.data() + sizeof(magic) + sizeof(sum),
                              text.size() - sizeof(magic) - sizeof(sum));
  if (sum != hash(body.data(), body.size(), 0)) {
    remove(key);
    return std::nullopt;
  }
  return std::vector<unsigned char>(body.begin(), body.end());
}

void ProgramCache::store(const std::string& key, const std::vector<unsigned char>& binary) {
  std::error_code ignored;  // a cache that cannot be written only costs time
  fs::create_directories(cache_folder(), ignored);
  const fs::path target = file_of(key);
  const fs::path temporary = target.string() + fmt::format(".{}.tmp", getpid());
  {
    std::ofstream out(temporary, std::ios::binary);
    const std::uint64_t sum = hash(binary.data(), binary.size(), 0);
    out.write(magic, sizeof(magic));
    out.write(reinterpret_cast<const char*>(&sum), sizeof(sum));
    out.write(reinterpret_cast<const char*>(binary.data()), static_cast<std::streamsize>(binary.size()));
    if (!out) {
      fs::remove(temporary, ignored);
      return;
    }
  }
  fs::rename(temporary, target, ignored);
}

void ProgramCache::remove(const std::string& key) {
  std::error_code ignored;
  fs::remove(file_of(key), ignored);
}

}  // namespace vivant
