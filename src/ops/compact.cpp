#include "vivant/ops/compact.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::int64_t chunk = 1024;

struct Compact final : Op {
  Compact(double threshold, std::int64_t capacity) : threshold(threshold), capacity(capacity) {}
  std::string_view name() const override { return "compact"; }
  static std::int64_t chunks_of(const Shape& weight) { return (weight.elements() + chunk - 1) / chunk; }
  TensorTypes infer(const TensorTypes&) const override {
    if (capacity < 1) fail("[compact] the capacity {} is not positive", capacity);
    return {{DType::i32, {capacity}}, {DType::i32, {capacity}}, {DType::i32, {1}}, {DType::i32, {1}}};
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::i32, {chunks_of(in[0].shape)}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &weight = launch.in(0), &offsets = launch.workspace();
    const std::int64_t chunks = chunks_of(weight.shape()), n = weight.elements();
    const std::array<std::size_t, 3> items{static_cast<std::size_t>(chunks), 1, 1};
    const std::array<std::size_t, 3> local{launch.gpu() ? 64u : 1u, 1, 1};
    const Defines defines{{"CHUNK", chunk}};
    launch.kernel("compact.cl", "count_chunks", defines)
        .args(weight, offsets, n, threshold)
        .run(items, local);
    launch.kernel("compact.cl", "scan_chunks", defines)
        .args(offsets, launch.out(2), launch.out(3), chunks, capacity)
        .run({1, 1, 1}, {1, 1, 1});
    launch.kernel("compact.cl", "write_ids", defines)
        .args(weight, offsets, launch.out(2), launch.out(0), launch.out(1), n, weight.channels(), capacity,
              chunks, threshold)
        .run(items, local);
  }
  Values gradient(const GradientRequest&) const override { return {Value{}}; }
  const double threshold;
  const std::int64_t capacity;
};

const RegisterOp registration({
    .name = "compact",
    .summary = "indices of the elements above a threshold, in order",
    .inputs = {{"weight", "[...]"}},
    .outputs = {{.name = "ids", .shape = "[capacity]", .dtype = DType::i32},
                {.name = "rows", .shape = "[capacity]", .dtype = DType::i32},
                {.name = "count", .shape = "[1]", .dtype = DType::i32},
                {.name = "overflow", .shape = "[1]", .dtype = DType::i32}},
    .attributes = {{"threshold", 0.0, "elements above it are taken"}, {"capacity", 1024, "the most indices"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const Compacted result = compact(in[0], a.number("threshold"), a.integer("capacity"));
      return {result.ids, result.rows, result.count, result.overflow};
    },
});

}  // namespace

Compacted compact(Value weight, double threshold, std::int64_t capacity) {
  const Values out = weight.graph->record(std::make_shared<Compact>(threshold, capacity), {weight});
  return {out[0], out[1], out[2], out[3]};
}

}  // namespace vivant
