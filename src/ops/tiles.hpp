#pragma once
#include <algorithm>
#include <cstdint>

#include "vivant/graph/launch.hpp"

namespace vivant {

/// Columns of a panel of packed weights for N columns: a multiple of 16, at most 64, with little waste. The
/// same on all devices, so that the packed shape is known when the graph is recorded.
inline std::int64_t panel_width(std::int64_t n) {
  const std::int64_t vectors = (n + 15) / 16;
  if (vectors <= 4) return 16 * vectors;
  for (std::int64_t width : {4, 3})
    if (vectors % width == 0) return 16 * width;
  return 64;
}

/// Rows of a panel for one tap of K input channels: padded for matrix units, which take 32 at a time, unless
/// there are so few that these do not pay.
constexpr std::int64_t least_bf16_channels = 16, most_bf16_channels = 4096;
inline std::int64_t packed_rows(std::int64_t k) { return k < least_bf16_channels ? k : (k + 31) / 32 * 32; }
/// Whether the product with K input channels runs on matrix units here: a work-item keeps 32 rows of them.
inline bool suits_bf16(const Launch& launch, std::int64_t k) {
  return launch.bf16() && k >= least_bf16_channels && k <= most_bf16_channels;
}

/// The tile of a kernel for panels of `panel` columns: what `vivant tune` found on this device, or the
/// default.
inline Tile choose_tile(const Launch& launch, TiledKernel kernel, std::int64_t panel) {
  const Device& device = launch.device();
  return device.tiles().find(kernel, panel).value_or(default_tile(kernel, device.device_class(), panel));
}

/// The tile of a weight gradient [m, n], columns on n: rows are spread evenly and are not more than m.
inline Tile choose_gradient_tile(const Launch& launch, TiledKernel kernel, std::int64_t m, std::int64_t n) {
  Tile tile = choose_tile(launch, kernel, panel_width(n));
  const std::int64_t count = (m + tile.rows - 1) / tile.rows;
  tile.rows = (m + count - 1) / count;
  return tile;
}

/// Whether a weight gradient [m, n] should have its vectors along m, because n does not fill vectors.
inline bool vectors_suit_first(std::int64_t m, std::int64_t n) {
  return n % 16 != 0 && (m % 16 == 0 || m > n);
}

inline std::size_t tiles(std::int64_t extent, std::int64_t tile) {
  return static_cast<std::size_t>((extent + tile - 1) / tile);
}

/// Panels of packed weights: columns and rows of one, and how many of its rows are written.
struct Panels {
  std::int64_t width, rows, written;
};
/// Packs w [taps, K, N], or with `transposed` what pack_weights makes of it. `count`: live rows of w, or
/// null.
void pack_fp32(Launch& launch, const Tensor& w, const Tensor& packed, bool transposed, std::int64_t taps,
               std::int64_t k, std::int64_t n, const Panels& panels, const Tensor& count);

/// Packs w [taps, K, N], or with `transposed` what pack_weights makes of it, as pairs for matrix units; K >=
/// least_bf16_channels. `count`: live rows of w, or null.
void pack_bf16(Launch& launch, const Tensor& w, const Tensor& packed, bool transposed, std::int64_t taps,
               std::int64_t k, std::int64_t n, const Tensor& count);

/// Launches y [taps, m, n] = sum of partial [chunks, taps, m, n], chunk after chunk; transposed: y [taps, n,
/// m].
void sum_weight_partials(Launch& launch, const Tensor& partial, const Tensor& y, std::int64_t chunks,
                         std::int64_t taps, std::int64_t m, std::int64_t n, bool transposed);

}  // namespace vivant
