#include "jobs/content_name.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include "vivant/io/atomic_file.hpp"

namespace vivant {

std::string content_name(const std::filesystem::path& file) {
  if (file.empty()) return "none";
  const std::string bytes = read_whole_file(file);
  const uLong sum = crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  return fmt::format("{} {:08x}", file.filename().string(), sum);
}

}  // namespace vivant
