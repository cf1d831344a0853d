#include "vivant/graph/launch.hpp"
#include "vivant/ops/rays.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::array<std::size_t, 3> thin_group{16, 4, 1};

std::array<std::size_t, 3> items(std::int64_t across, const Tensor& depths) {
  return {static_cast<std::size_t>(across), static_cast<std::size_t>(depths[0]), 1};
}

struct StratifiedDepths final : Op {
  StratifiedDepths(int samples, Spacing spacing, int stream, bool jitter)
      : samples(samples), spacing(spacing), stream(stream), jitter(jitter) {}
  std::string_view name() const override { return "stratified_samples"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& near = in[0].shape;
    if (near.rank() != 2 || near[1] != 1 || in[1].shape != near)
      fail("[stratified_samples] near and far must be [R, 1], they are {} and {}", near.text(),
           in[1].shape.text());
    for (int i : {2, 3})
      if (in[i].dtype != DType::i32 || in[i].shape.elements() != 1)
        fail("[stratified_samples] seed and step must be i32 [1]");
    if (samples < 1) fail("[stratified_samples] {} samples: there must be at least one", samples);
    return {{DType::real, {near[0], samples}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& depths = launch.out();
    launch.kernel("stratified_samples.cl", "stratified_depths", {{"SPACING", static_cast<int>(spacing)}})
        .args(launch.in(0), launch.in(1), launch.in(2), launch.in(3), depths, stream, jitter ? 1 : 0,
              depths[0], depths[1])
        .run(items((samples + 3) / 4, depths), thin_group);
  }
  const int samples;
  const Spacing spacing;
  const int stream;
  const bool jitter;
};

struct SampleIntervals final : Op {
  std::string_view name() const override { return "sample_intervals"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &depths = in[0].shape, &far = in[1].shape;
    if (depths.rank() != 2 || far.elements() != depths[0])
      fail("[sample_intervals] depths must be [R, S] and far [R, 1], they are {} and {}", depths.text(),
           far.text());
    return {{DType::real, depths}};
  }
  void launch(Launch& launch) const override {
    const Tensor& depths = launch.in(0);
    launch.kernel("stratified_samples.cl", "sample_intervals")
        .args(depths, launch.in(1), launch.out(), depths[0], depths[1])
        .run(items(depths[1], depths), thin_group);
  }
};

const RegisterOp register_stratified_samples({
    .name = "stratified_samples",
    .summary = "one sample in each stratum between near and far",
    .inputs =
        {{"near", "[R, 1]"}, {"far", "[R, 1]"}, {"seed", "[1]", DType::i32}, {"step", "[1]", DType::i32}},
    .outputs = {{"depths", "[R, S]"}, {"deltas", "[R, S]"}},
    .attributes = {{"samples", 128, "on each ray"},
                   {"spacing", "linear", "linear or disparity"},
                   {"stream", 0, "a number of its own for every use in a graph"},
                   {"jitter", true, "at a random place of the stratum, not in its middle"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const Samples samples = stratified_samples(
          in[0], in[1], static_cast<int>(a.integer("samples")), spacing_from(a.text("spacing")),
          {in[2], in[3], static_cast<int>(a.integer("stream"))}, a.flag("jitter"));
      return {samples.depths, samples.deltas};
    },
});

}  // namespace

Spacing spacing_from(const std::string& name) {
  if (name == "linear") return Spacing::linear;
  if (name == "disparity") return Spacing::disparity;
  throw UsageError(fmt::format("unknown spacing '{}': use linear or disparity", name));
}

Value sample_intervals(Value depths, Value far) {
  return depths.graph->record_one(SampleIntervals(), {depths, far});
}

Samples stratified_samples(Value near, Value far, int samples, Spacing spacing, const RandomKey& key,
                           bool jitter) {
  const Value depths = near.graph->record_one(StratifiedDepths(samples, spacing, key.stream, jitter),
                                              {near, far, key.seed, key.step});
  return {depths, sample_intervals(depths, far)};
}

}  // namespace vivant
