#pragma once
#include <cstdint>
#include <optional>
#include <string>

namespace vivant {

/// What a progress bar shows.
struct BarContent {
  std::string stage;
  std::int64_t step = 0, steps = 0;
  std::optional<double> loss = {}, psnr = {};
  double rays_per_second = 0;  ///< 0: not shown
  double seconds_left = -1;    ///< below 0: not known yet
  std::size_t memory_bytes = 0;
};

/// One line of at most `width` characters; the bar takes what the numbers leave.
std::string bar_text(const BarContent& content, int width);

/// "1:02:03" or "02:03".
std::string duration_text(double seconds);

/// Memory that this process has in use now, the buffers of CPU devices included.
std::size_t resident_memory_bytes();

}  // namespace vivant
