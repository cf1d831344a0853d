#pragma once
#include "vivant/graph/launch.hpp"

namespace vivant {

constexpr std::int64_t scan_chunk = 256;
inline std::int64_t scan_chunks_of(std::int64_t n) { return (n + scan_chunk - 1) / scan_chunk; }

/// starts [n + 1] = exclusive prefix sums of counts [n], none above `capacity`; total [1] is the last of them
/// and overflow [1] is 1 when it was cut off. `sums` is i32 scratch [scan_chunks_of(n)].
inline void scan_counts(Launch& launch, const Tensor& counts, const Tensor& sums, const Tensor& starts,
                        const Tensor& total, const Tensor& overflow, std::int64_t n, std::int64_t capacity) {
  const std::int64_t chunks = scan_chunks_of(n);
  const std::array<std::size_t, 3> items{static_cast<std::size_t>(chunks), 1, 1};
  const std::array<std::size_t, 3> local{launch.gpu() ? 64u : 1u, 1, 1};
  const Defines defines{{"CHUNK", scan_chunk}};
  launch.kernel("scan.cl", "scan_chunks", defines).args(counts, sums, n).run(items, local);
  launch.kernel("scan.cl", "scan_sums", defines)
      .args(sums, total, overflow, chunks, capacity)
      .run({1, 1, 1}, {1, 1, 1});
  launch.kernel("scan.cl", "scan_starts", defines).args(counts, sums, starts, n, capacity).run(items, local);
}

}  // namespace vivant
