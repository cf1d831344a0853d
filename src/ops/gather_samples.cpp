#include "ops/scan.hpp"
#include "vivant/ops/human_samples.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// Inputs: records, offsets, frames or absent, roots or absent, rays, jitter or absent. Outputs: those of
/// HumanSamples in order (without root when there are no roots: one row), then count.
struct GatherSamples final : Op {
  GatherSamples(double step, std::int64_t samples_per_ray, std::int64_t capacity)
      : step(step), samples_per_ray(samples_per_ray), capacity(capacity) {}
  std::string_view name() const override { return "gather_samples"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& records = in[0].shape;
    if (records.rank() != 2 || records[1] != sample_record_words || in[0].dtype != DType::i32)
      fail("[gather_samples] records are {} {}, not i32 [M, {}]", name_of(in[0].dtype), records.text(),
           sample_record_words);
    const std::int64_t table_rays = in[1].shape.elements() - 1, rays = in[4].shape.elements();
    if (in[2].shape.rank() > 0 && in[2].shape.elements() != table_rays)
      fail("[gather_samples] frames {} do not fit {} rays", in[2].shape.text(), table_rays);
    if (in[3].shape.rank() > 0 && in[3].shape != Shape{table_rays, 6})
      fail("[gather_samples] roots {} are not [{}, 6]", in[3].shape.text(), table_rays);
    if (in[5].shape.rank() > 0 && in[5].shape.elements() != rays)
      fail("[gather_samples] jitter {} does not fit {} rays", in[5].shape.text(), rays);
    const TensorType vectors{DType::real, {capacity, 3}}, numbers{DType::real, {capacity, 1}};
    const TensorType indices{DType::i32, {capacity, 1}}, dense{DType::real, {rays, samples_per_ray}};
    const TensorType single{DType::i32, {1}};
    return {vectors,
            vectors,
            vectors,
            in[3].shape.rank() > 0 ? vectors : TensorType{DType::real, {1, 3}},
            numbers,
            indices,
            vectors,
            indices,
            {DType::i32, {capacity}},
            dense,
            dense,
            {DType::i32, {rays, samples_per_ray}},
            single,
            single};
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    const std::int64_t rays = in[4].shape.elements();
    return {{DType::i32, {rays}}, {DType::i32, {scan_chunks_of(rays)}}, {DType::i32, {rays + 1}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &offsets = launch.in(1), &rays = launch.in(4), &starts = launch.workspace(2);
    const std::int64_t count = rays.elements(), per_item = launch.gpu() ? 1 : 16;
    const Defines defines{{"RAYS", per_item}, {"HAS_ROOTS", launch.in(3) ? 1 : 0}};
    launch.kernel("gather_samples.cl", "count_samples", defines)
        .args(rays, offsets, launch.workspace(0), count, samples_per_ray)
        .run({static_cast<std::size_t>(count), 1, 1}, {64, 1, 1});
    scan_counts(launch, launch.workspace(0), launch.workspace(1), starts, launch.out(13), launch.out(12),
                count, capacity);
    auto call = launch.kernel("gather_samples.cl", "gather_samples", defines);
    call.args(launch.in(0), offsets, launch.in(2), launch.in(3), rays, launch.in(5), starts);
    for (int i = 0; i < 12; ++i) call.args(launch.out(i));
    call.args(step, no_sample_depth, count, samples_per_ray)
        .run({static_cast<std::size_t>((count + per_item - 1) / per_item), 1, 1},
             {launch.gpu() ? 64u : 1u, 1, 1});
  }
  Values gradient(const GradientRequest&) const override { return Values(6); }
  const double step;
  const std::int64_t samples_per_ray, capacity;
};

const RegisterOp register_gather_samples({
    .name = "gather_samples",
    .summary = "the traced samples of some rays as rows of tensors",
    .inputs = {{"records", "[M, 9]", DType::i32},
               {"offsets", "[R + 1, 1]", DType::i32},
               {"frames", "[R, 1]", DType::i32, true},
               {.name = "roots", .shape = "[R, 6]", .optional = true},
               {"rays", "[B]", DType::i32},
               {.name = "jitter", .shape = "[B, 1]", .optional = true}},
    .outputs = {{"points", "[N, 3]"},
                {"directions", "[N, 3]"},
                {"normals", "[N, 3]"},
                {"signed_distance", "[N, 1]"},
                {"face", "[N, 1]", DType::i32},
                {"barycentric", "[N, 3]"},
                {"frame", "[N, 1]", DType::i32},
                {"ids", "[N, 1]", DType::i32},
                {"depths", "[B, S]"},
                {"deltas", "[B, S]"},
                {.name = "rows", .shape = "[B, S]", .dtype = DType::i32},
                {"overflow", "[1]", DType::i32},
                {.name = "root", .shape = "[N, 3]", .optional = true}},
    .attributes = {{"step", 0.0075, "metres between samples"},
                   {"samples_per_ray", 192, "the most of one ray, S"},
                   {"capacity", 0, "rows, N; 0: B * S"}},
    .build = [](Graph& graph, const Values& in, const Attributes& a) -> Values {
      const HumanSamples s = gather_samples({in[0], in[1], in[2], in[3]}, in[4], in[5], a.number("step"),
                                            a.integer("samples_per_ray"), a.integer("capacity"));
      const Value ids = graph.with_count(graph.reshape(s.ids, {s.ids.elements(), 1}), s.points.count());
      Values out = {s.points, s.directions, s.normals, s.signed_distance, s.face, s.barycentric,
                    s.frame,  ids,          s.depths,  s.deltas,          s.rows, s.overflow};
      if (s.root) out.push_back(s.root);
      return out;
    },
});

}  // namespace

HumanSamples gather_samples(const SampleTable& table, Value rays, Value jitter, double step,
                            std::int64_t samples_per_ray, std::int64_t capacity) {
  Graph& graph = *table.records.graph;
  if (capacity == 0) capacity = rays.elements() * samples_per_ray;
  const Values out = graph.record(std::make_shared<GatherSamples>(step, samples_per_ray, capacity),
                                  {table.records, table.offsets, table.frames, table.roots, rays, jitter});
  const auto rows = [&](int i) { return graph.with_count(out[i], out[13]); };
  return {rows(0), rows(1), rows(2), table.roots ? rows(3) : Value{},
          rows(4), rows(5), rows(6), rows(7),
          out[8],  out[9],  out[10], out[11],
          out[12]};
}

}  // namespace vivant
