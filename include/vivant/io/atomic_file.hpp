#pragma once
#include <cstddef>
#include <filesystem>
#include <string_view>

namespace vivant {

/// A file that appears under its name only when complete. Writes go to a temporary file in the same folder;
/// commit() makes it durable and renames it; without commit() it is removed.
class AtomicFile {
 public:
  /// Creates the temporary file; throws Error when the folder is missing or cannot be written.
  explicit AtomicFile(std::filesystem::path path);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  void write(const void* data, std::size_t size);
  void write(std::string_view text) { write(text.data(), text.size()); }
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
};

/// A name in the folder of `path` for a file in the making, with the extension of `path`.
std::filesystem::path temporary_name(const std::filesystem::path& path);

/// Makes the finished file `temporary` durable and gives it the name `path` (same folder).
void replace_file(const std::filesystem::path& temporary, const std::filesystem::path& path);

/// Makes a folder and those above it; nothing when it exists. Throws Error when it cannot be made.
void make_folder(const std::filesystem::path& path);

/// Writes a whole text atomically.
void write_text_file(const std::filesystem::path& path, std::string_view text);

/// Reads a whole file; throws Error when it is missing or cannot be read.
std::string read_whole_file(const std::filesystem::path& path);

}  // namespace vivant
