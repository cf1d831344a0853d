#include "graph/memory_plan.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

using namespace vivant;

namespace {

bool alive_together(const MemoryRequest& a, const MemoryRequest& b) {
  return a.first <= b.last && b.first <= a.last;
}

/// Everything that a plan promises.
void check_plan(const std::vector<MemoryRequest>& requests, const MemoryPlan& plan, std::size_t alignment,
                std::size_t largest_slab) {
  std::size_t total = 0, padding = 0;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const MemoryRequest& a = requests[i];
    REQUIRE(a.slab < plan.slab_bytes.size());
    CHECK(a.offset % alignment == 0);
    CHECK(a.offset + a.bytes <= plan.slab_bytes[a.slab]);
    CHECK((a.offset + a.bytes <= largest_slab || (a.offset == 0 && a.bytes > largest_slab)));
    for (std::size_t j = 0; j < i; ++j) {
      const MemoryRequest& b = requests[j];
      const bool overlap = a.slab == b.slab && a.offset < b.offset + b.bytes && b.offset < a.offset + a.bytes;
      CHECK_FALSE((overlap && alive_together(a, b)));
    }
    padding += alignment;
  }
  for (std::size_t bytes : plan.slab_bytes) total += bytes;
  CHECK(total + padding >= plan.lower_bound);
}

}  // namespace

TEST_CASE("memory plan: nothing that is alive together overlaps, whatever the requests") {
  std::mt19937 random(1);
  const auto number = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  for (int trial = 0; trial < 200; ++trial) {
    const int steps = number(1, 40);
    std::vector<MemoryRequest> requests;
    for (int i = number(0, 60); i > 0; --i) {
      const int first = number(0, steps - 1);
      requests.push_back({static_cast<std::size_t>(number(1, 5000)), first, number(first, steps - 1)});
    }
    const std::size_t alignment = std::size_t{1} << number(0, 8), largest = number(2000, 20000);
    const MemoryPlan plan = plan_memory(requests, alignment, largest);
    check_plan(requests, plan, alignment, largest);
    std::size_t most = 0;
    for (int step = 0; step < steps; ++step) {
      std::size_t alive = 0;
      for (const MemoryRequest& request : requests)
        if (request.first <= step && step <= request.last) alive += request.bytes;
      most = std::max(most, alive);
    }
    CHECK(plan.lower_bound == most);
  }
}

TEST_CASE("memory plan: a chain needs the memory of two neighbours, and slabs have a limit") {
  std::vector<MemoryRequest> chain;
  for (int i = 0; i < 50; ++i) chain.push_back({1024, i, i + 1});
  MemoryPlan plan = plan_memory(chain, 128, 1 << 20);
  CHECK(plan.lower_bound == 2048);
  CHECK(plan.slab_bytes == std::vector<std::size_t>{2048});

  std::vector<MemoryRequest> wide(5, {1000, 0, 3});
  wide.push_back({7000, 1, 1});  // larger than any slab may be: one of its own
  plan = plan_memory(wide, 128, 3000);
  check_plan(wide, plan, 128, 3000);
  CHECK(plan.slab_bytes.size() == 4);
  CHECK(std::count_if(plan.slab_bytes.begin(), plan.slab_bytes.end(),
                      [](auto bytes) { return bytes > 3000; }) == 1);

  std::vector<MemoryRequest> none;
  CHECK(plan_memory(none, 128, 3000).slab_bytes.empty());
}
