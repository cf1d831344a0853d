#pragma once
#include <algorithm>
#include <cstdint>

#include "vivant/graph/launch.hpp"

namespace vivant {

/// How a long sum is cut into chunks whose partial sums are added in order. The cut depends on the length
/// alone, never on the number of threads, so that the bits are the same on one thread and on many.
inline std::int64_t chunk_length(std::int64_t length, std::int64_t shortest = 512,
                                 std::int64_t most_chunks = 64) {
  return std::max(shortest, (length + most_chunks - 1) / most_chunks);
}
inline std::int64_t chunks_of(std::int64_t length, std::int64_t shortest = 512,
                              std::int64_t most_chunks = 64) {
  const std::int64_t chunk = chunk_length(length, shortest, most_chunks);
  return (length + chunk - 1) / chunk;
}

/// Launches y[n] = sum of partials [chunks, n], chunk after chunk.
void reduce_partials(Launch& launch, const Tensor& partials, const Tensor& y, std::int64_t chunks,
                     std::int64_t n);

}  // namespace vivant
