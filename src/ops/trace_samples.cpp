#include "ops/scan.hpp"
#include "vivant/ops/human_samples.hpp"
#include "vivant/ops/inverse_warp.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// How far the march looks beyond the threshold, so that it can jump over empty space.
constexpr double look_ahead = 0.15;

/// Inputs: origins, directions, vertices, leaves, bounds, normals, triangles, leaf_triangles, neighbours,
/// transforms. Outputs: records, offsets, count, overflow.
struct TraceSamples final : Op {
  explicit TraceSamples(const TraceOptions& options) : options(options) {}
  std::string_view name() const override { return "trace_samples"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& origins = in[0].shape;
    if (origins.rank() != 2 || origins[1] != 3 || in[1].shape != origins)
      fail("[trace_samples] origins {} and directions {} are not both [R, 3]", origins.text(),
           in[1].shape.text());
    if (in[9].shape != Shape{in[2].shape[0], 12})
      fail("[trace_samples] transforms {} do not fit {} vertices", in[9].shape.text(), in[2].shape[0]);
    if (!(options.step > 0) || !(options.threshold > 0) || options.samples_per_ray < 1)
      fail("[trace_samples] step {}, threshold {} and samples per ray {} must be positive", options.step,
           options.threshold, options.samples_per_ray);
    return {{DType::i32, {capacity(origins[0]), sample_record_words}},
            {DType::i32, {origins[0] + 1, 1}},
            {DType::i32, {1}},
            {DType::i32, {1}}};
  }
  std::int64_t capacity(std::int64_t rays) const {
    return options.capacity > 0 ? options.capacity : rays * options.samples_per_ray;
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    const std::int64_t rays = in[0].shape[0];
    return {{DType::i32, {rays, options.samples_per_ray, 2}},
            {DType::i32, {rays}},
            {DType::i32, {scan_chunks_of(rays)}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &origins = launch.in(0), &directions = launch.in(1), &found = launch.workspace(0);
    const std::int64_t rays = origins[0], per_item = launch.gpu() ? 1 : 8;
    const std::array<std::size_t, 3> items{static_cast<std::size_t>((rays + per_item - 1) / per_item), 1, 1};
    const std::array<std::size_t, 3> local{launch.gpu() ? 64u : 1u, 1, 1};
    const Defines defines{{"RAYS", per_item}};
    launch.kernel("trace_samples.cl", "march", defines)
        .args(origins, directions, launch.in(3), launch.in(4), launch.in(7), found, launch.workspace(1),
              launch.in(7)[0], options.step, options.threshold, options.threshold + look_ahead,
              options.samples_per_ray, rays, launch.count_of(origins))
        .run(items, local);
    scan_counts(launch, launch.workspace(1), launch.workspace(2), launch.out(1), launch.out(2), launch.out(3),
                rays, capacity(rays));
    launch.kernel("trace_samples.cl", "pack_records", defines)
        .args(origins, directions, launch.in(2), launch.in(5), launch.in(6), launch.in(8), launch.in(9),
              found, launch.out(1), launch.out(0), options.step, no_canonical_point, options.samples_per_ray,
              rays)
        .run(items, local);
  }
  Values gradient(const GradientRequest&) const override { return Values(10); }
  const TraceOptions options;
};

const RegisterOp register_human_samples({
    .name = "human_samples",
    .summary = "the samples of rays near a posed body, warped to the canonical pose",
    .inputs = {{"origins", "[R, 3]"},
               {"directions", "[R, 3]"},
               {"vertices", "[V, 3]"},
               {"transforms", "[V, 12]"},
               {"triangles", "[F, 3]", DType::i32},
               {"leaf_triangles", "[L, 16]", DType::i32},
               {"neighbours", "[F, 3]", DType::i32},
               {"corner_offsets", "[V + 1, 1]", DType::i32},
               {"corners", "[3 F, 1]", DType::i32},
               {"rays", "[B]", DType::i32},
               {.name = "jitter", .shape = "[B, 1]", .optional = true}},
    .outputs = {{"points", "[N, 3]"},
                {"signed_distance", "[N, 1]"},
                {"depths", "[B, S]"},
                {"deltas", "[B, S]"},
                {"offsets", "[R + 1, 1]", DType::i32}},
    .attributes = {{"step", 0.0075, "metres between samples"},
                   {"threshold", 0.08, "metres: samples farther from the body are left out"},
                   {"samples_per_ray", 192, "the most of one ray, S"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const PosedMesh mesh = refit_mesh(in[2], {in[4], in[5], in[6], in[7], in[8]});
      const TraceOptions options{.step = a.number("step"),
                                 .threshold = a.number("threshold"),
                                 .samples_per_ray = a.integer("samples_per_ray")};
      const TracedSamples traced = trace_samples(in[0], in[1], mesh, in[3], options);
      const HumanSamples samples = gather_samples({traced.records, traced.offsets, {}, {}}, in[9], in[10],
                                                  options.step, options.samples_per_ray);
      return {samples.points, samples.signed_distance, samples.depths, samples.deltas, traced.offsets};
    },
});

}  // namespace

TracedSamples trace_samples(Value origins, Value directions, const PosedMesh& mesh, Value transforms,
                            const TraceOptions& options) {
  Graph& graph = *origins.graph;
  const Values out =
      graph.record(std::make_shared<TraceSamples>(options),
                   {origins, directions, mesh.vertices, mesh.leaves, mesh.bounds, mesh.normals,
                    mesh.index.triangles, mesh.index.leaf_triangles, mesh.index.neighbours, transforms});
  return {graph.with_count(out[0], out[2]), out[1], out[3]};
}

}  // namespace vivant
