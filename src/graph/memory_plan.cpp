#include "graph/memory_plan.hpp"

#include <algorithm>
#include <numeric>

namespace vivant {
namespace {

std::size_t round_up(std::size_t bytes, std::size_t alignment) {
  return (bytes + alignment - 1) / alignment * alignment;
}

/// The lowest offset in a slab with room for `request` beside those of `placed` that are alive with it.
std::size_t lowest_offset(const std::vector<const MemoryRequest*>& placed, const MemoryRequest& request,
                          std::size_t alignment) {
  std::size_t offset = 0;
  for (const MemoryRequest* other : placed) {  // sorted by offset
    if (other->last < request.first || request.last < other->first) continue;
    if (offset + request.bytes <= other->offset) break;
    offset = std::max(offset, round_up(other->offset + other->bytes, alignment));
  }
  return offset;
}

}  // namespace

MemoryPlan plan_memory(std::vector<MemoryRequest>& requests, std::size_t alignment,
                       std::size_t largest_slab) {
  MemoryPlan plan;
  int steps = 0;
  for (const MemoryRequest& request : requests) steps = std::max(steps, request.last + 1);
  std::vector<std::ptrdiff_t> change(steps + 1, 0);
  for (const MemoryRequest& request : requests) {
    change[request.first] += static_cast<std::ptrdiff_t>(request.bytes);
    change[request.last + 1] -= static_cast<std::ptrdiff_t>(request.bytes);
  }
  std::ptrdiff_t alive = 0;
  for (std::ptrdiff_t delta : change) {
    alive += delta;
    plan.lower_bound = std::max(plan.lower_bound, static_cast<std::size_t>(alive));
  }

  std::vector<std::size_t> order(requests.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return requests[a].bytes > requests[b].bytes; });
  std::vector<std::vector<const MemoryRequest*>> placed;
  for (std::size_t index : order) {
    MemoryRequest& request = requests[index];
    for (request.slab = 0;; ++request.slab) {
      if (request.slab == placed.size()) {
        placed.emplace_back();
        plan.slab_bytes.push_back(0);
      }
      request.offset = lowest_offset(placed[request.slab], request, alignment);
      if (request.offset + request.bytes <= largest_slab || placed[request.slab].empty()) break;
    }
    auto& slab = placed[request.slab];
    slab.insert(std::upper_bound(slab.begin(), slab.end(), &request,
                                 [](auto* a, auto* b) { return a->offset < b->offset; }),
                &request);
    plan.slab_bytes[request.slab] = std::max(plan.slab_bytes[request.slab], request.offset + request.bytes);
  }
  return plan;
}

}  // namespace vivant
