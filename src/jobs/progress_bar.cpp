#include "jobs/progress_bar.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>

namespace vivant {
namespace {

std::string count_text(double count) {
  if (count >= 1e6) return fmt::format("{:.1f}M", count * 1e-6);
  if (count >= 1e3) return fmt::format("{:.0f}k", count * 1e-3);
  return fmt::format("{:.0f}", count);
}

}  // namespace

std::string duration_text(double seconds) {
  const std::int64_t whole = std::llround(seconds);
  if (whole < 3600) return fmt::format("{:02}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string bar_text(const BarContent& content, int width) {
  std::string numbers = fmt::format(" {}/{}", content.step, content.steps);
  if (content.loss) numbers += fmt::format("  loss {:.4g}", *content.loss);
  if (content.psnr) numbers += fmt::format("  {:.1f} dB", *content.psnr);
  if (content.rays_per_second > 0) numbers += fmt::format("  {} rays/s", count_text(content.rays_per_second));
  if (content.seconds_left >= 0) numbers += fmt::format("  {} left", duration_text(content.seconds_left));
  numbers += fmt::format("  {} MiB", content.memory_bytes >> 20);
  const int room = std::clamp(width - static_cast<int>(content.stage.size() + numbers.size()) - 3, 0, 40);
  std::string bar;
  if (room >= 5) {
    const double part =
        content.steps > 0 ? static_cast<double>(content.step) / static_cast<double>(content.steps) : 1;
    const int full = static_cast<int>(std::clamp(part, 0.0, 1.0) * room);
    bar = " [" + std::string(full, '#') + std::string(room - full, '-') + "]";
  }
  return (content.stage + bar + numbers).substr(0, static_cast<std::size_t>(std::max(width, 0)));
}

std::size_t resident_memory_bytes() {
  std::ifstream statistics("/proc/self/statm");
  std::size_t size = 0, resident = 0;
  statistics >> size >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace vivant
