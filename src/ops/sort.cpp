#include "ops/sort.hpp"

namespace vivant {
namespace {

constexpr std::int64_t chunk = 512, digits = 256;
constexpr int digit_bits = 8;

std::int64_t chunks_of(std::int64_t n) { return (n + chunk - 1) / chunk; }

}  // namespace

TensorTypes sort_workspaces(std::int64_t lists, std::int64_t n) {
  const TensorType list{DType::i32, {lists, n}};
  return {list, list, list, list, {DType::i32, {lists, digits, chunks_of(n) + 1}}};
}

Sorted sort(Launch& launch, int first_workspace, std::int64_t end) {
  Sorted from{launch.workspace(first_workspace), Tensor{}};
  Sorted to{launch.workspace(first_workspace + 1), launch.workspace(first_workspace + 2)};
  Tensor spare_places = launch.workspace(first_workspace + 3);
  const Tensor& counts = launch.workspace(first_workspace + 4);
  const std::int64_t n = from.keys[1], chunks = chunks_of(n);
  const auto lists = static_cast<std::size_t>(from.keys[0]);
  const std::array<std::size_t, 3> items{static_cast<std::size_t>(chunks), lists, 1}, local{32, 1, 1};
  const Defines defines{{"CHUNK", chunk}};
  for (int shift = 0; shift == 0 || (end - 1) >> shift > 0; shift += digit_bits) {
    launch.kernel("sort.cl", "sort_count", defines)
        .args(from.keys, counts, n, shift, chunks)
        .run(items, local);
    launch.kernel("sort.cl", "sort_scan", defines)
        .args(counts, chunks)
        .run({static_cast<std::size_t>(digits), lists, 1}, local);
    launch.kernel("sort.cl", "sort_move", defines)
        .args(from.keys, from.places, counts, to.keys, to.places, n, shift, chunks)
        .run(items, local);
    const Tensor next_places = from.places ? from.places : spare_places;
    std::swap(from, to);
    to.places = next_places;
  }
  return from;
}

}  // namespace vivant
