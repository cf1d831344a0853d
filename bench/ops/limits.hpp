#pragma once
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "vivant/graph/launch.hpp"

namespace vivant::bench {

/// What a device can do at most, as kernels/limits.cl measures it.
struct Limits {
  double flops = 0;  ///< per second: fused multiply-adds in fp32, each counts as two
  double read_bandwidth = 0, triad_bandwidth = 0;  ///< bytes per second, arrays far beyond the caches
  double launch_seconds = 0;                       ///< of one launch among many
  double launch_and_finish_seconds = 0;            ///< of one launch and the wait for its end
  double matrix_flops = 0;  ///< the same by matrix units in the device's arithmetic; 0 when that is fp32
  std::string matrix_units = "none";  ///< and the arithmetic they run, if any

  double peak_flops() const { return std::max(flops, matrix_flops); }
  double bandwidth() const { return std::max(read_bandwidth, triad_bandwidth); }
  /// The roofline: the least time for so much arithmetic and so many bytes of memory.
  double least_seconds(double work_flops, double work_bytes) const {
    return std::max(work_flops / peak_flops(), work_bytes / bandwidth());
  }
};

/// `quick`: smaller arrays and fewer repetitions.
Limits measure_limits(Device& device, bool quick);
/// Limits::launch_seconds alone.
double launch_seconds(Device& device, bool quick);

/// The limits in words.
std::string describe(const Limits& limits);
nlohmann::json to_json(const Limits& limits);

// ---- the kernels of kernels/limits.cl, ready to launch; buffers hold floats ----

constexpr std::size_t fma_chain_count = 16;  ///< of each vector lane of a work-item

/// y [items, vector width] of `items` work-items (a multiple of 64): the sum of the chains x = x * m + a
/// after `steps`, chain c starting at 1 / (c + 1).
Command fma_chains(Device& device, const Buffer& y, std::size_t items, double multiplier, double addend,
                   int steps);
/// y [items]: 128 `steps`, by products of [32, 128] and [128, 64] on matrix units.
Command matrix_products(Device& device, const Buffer& y, std::size_t items, int steps);
/// y = a + s b. All three hold the same multiple of `granule_bytes`.
Command triad(Device& device, const Buffer& a, const Buffer& b, const Buffer& y, double s);
/// Sums that make up the sum of x, which holds a multiple of `granule_bytes`; `partial` has `partial_bytes`.
Command read_sum(Device& device, const Buffer& x, const Buffer& partial);
/// y [0] = 1.
Command touch(Device& device, const Buffer& y);

std::size_t granule_bytes(const Device& device);
std::size_t partial_bytes(const Device& device, const Buffer& x);

}  // namespace vivant::bench
