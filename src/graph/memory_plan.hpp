#pragma once
#include <cstddef>
#include <vector>

namespace vivant {

/// A block of memory that is needed from step `first` to step `last`, both included.
struct MemoryRequest {
  std::size_t bytes = 0;
  int first = 0, last = 0;
  std::size_t slab = 0, offset = 0;  // the answer
};

struct MemoryPlan {
  std::vector<std::size_t> slab_bytes;
  std::size_t lower_bound = 0;  // the most that is alive at one step
};

/// Places every request so that those alive at the same step do not overlap: largest first, each at the
/// lowest free offset of the first slab that has room. Offsets are multiples of `alignment`; no slab grows
/// beyond `largest_slab`, except for one that holds a single larger request.
MemoryPlan plan_memory(std::vector<MemoryRequest>& requests, std::size_t alignment, std::size_t largest_slab);

}  // namespace vivant
