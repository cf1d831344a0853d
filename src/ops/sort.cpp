#include "ops/sort.hpp"

namespace vivant {
namespace {

/// A pass sorts by `bits` bits; a work-item counts the keys of one chunk. CPUs like few passes and long
/// chunks.
struct Passes {
  int bits;
  std::int64_t chunk, chunks;

  Passes(bool gpu, std::int64_t n)
      : bits(gpu ? 8 : 12),
        chunk(gpu ? 512 : std::max<std::int64_t>(4096, (n + 31) / 32)),
        chunks((n + chunk - 1) / chunk) {}
  std::int64_t digits() const { return std::int64_t{1} << bits; }
};

}  // namespace

TensorTypes sort_workspaces(std::int64_t lists, std::int64_t n) {
  const TensorType list{DType::i32, {lists, n}};
  const auto counts = [&](bool gpu) {
    const Passes passes(gpu, n);
    return passes.digits() * (passes.chunks + 1);
  };
  return {list, list, list, list, {DType::i32, {lists, std::max(counts(true), counts(false))}}};
}

Sorted sort(Launch& launch, int first_workspace, std::int64_t lists, std::int64_t end) {
  Sorted from{launch.workspace(first_workspace), Tensor{}};
  Sorted to{launch.workspace(first_workspace + 1), launch.workspace(first_workspace + 2)};
  Tensor spare_places = launch.workspace(first_workspace + 3);
  const Tensor& counts = launch.workspace(first_workspace + 4);
  const std::int64_t n = from.keys[1];
  const Passes passes(launch.gpu(), n);
  const std::array<std::size_t, 3> items{static_cast<std::size_t>(passes.chunks),
                                         static_cast<std::size_t>(lists), 1};
  const std::array<std::size_t, 3> local{launch.gpu() ? 32u : 1u, 1, 1};
  const Defines defines{{"CHUNK", passes.chunk}, {"DIGITS", passes.digits()}};
  for (int shift = 0; shift == 0 || (end - 1) >> shift > 0; shift += passes.bits) {
    launch.kernel("sort.cl", "sort_count", defines)
        .args(from.keys, counts, n, shift, passes.chunks)
        .run(items, local);
    launch.kernel("sort.cl", "sort_scan", defines)
        .args(counts, passes.chunks)
        .run({static_cast<std::size_t>(passes.digits()), static_cast<std::size_t>(lists), 1}, {32, 1, 1});
    launch.kernel("sort.cl", "sort_move", defines)
        .args(from.keys, from.places, counts, to.keys, to.places, n, shift, passes.chunks)
        .run(items, local);
    const Tensor next_places = from.places ? from.places : spare_places;
    std::swap(from, to);
    to.places = next_places;
  }
  return from;
}

}  // namespace vivant
