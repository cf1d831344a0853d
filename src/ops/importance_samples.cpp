#include "vivant/graph/launch.hpp"
#include "vivant/ops/rays.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// Inputs: depths, weight, near, far, seed, step.
struct ImportanceSamples final : Op {
  ImportanceSamples(int samples, int stream, bool jitter)
      : samples(samples), stream(stream), jitter(jitter) {}
  std::string_view name() const override { return "importance_samples"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& depths = in[0].shape;
    if (depths.rank() != 2 || in[1].shape != depths)
      fail("[importance_samples] depths and weight must be [R, S], they are {} and {}", depths.text(),
           in[1].shape.text());
    for (int i : {2, 3})
      if (in[i].shape.elements() != depths[0])
        fail("[importance_samples] near and far must be [R, 1], they are {} and {}", in[2].shape.text(),
             in[3].shape.text());
    for (int i : {4, 5})
      if (in[i].dtype != DType::i32 || in[i].shape.elements() != 1)
        fail("[importance_samples] seed and step must be i32 [1]");
    if (samples < 1) fail("[importance_samples] {} samples: there must be at least one", samples);
    return {{DType::real, {depths[0], samples}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& depths = launch.in(0);
    launch.kernel("importance_samples.cl", "importance_samples")
        .args(depths, launch.in(1), launch.in(2), launch.in(3), launch.in(4), launch.in(5), launch.out(),
              stream, jitter ? 1 : 0, depths[0], depths[1], samples)
        .run({static_cast<std::size_t>(depths[0]), 1, 1}, {launch.gpu() ? std::size_t{64} : 1, 1, 1});
  }
  const int samples, stream;
  const bool jitter;
};

const RegisterOp register_importance_samples({
    .name = "importance_samples",
    .summary = "samples where the weight of coarse samples is",
    .inputs = {{"depths", "[R, S]"},
               {"weight", "[R, S]"},
               {"near", "[R, 1]"},
               {"far", "[R, 1]"},
               {"seed", "[1]", DType::i32},
               {"step", "[1]", DType::i32}},
    .outputs = {{"depths", "[R, N]"}, {"deltas", "[R, N]"}},
    .attributes = {{"samples", 128, "on each ray"},
                   {"stream", 0, "a number of its own for every use in a graph"},
                   {"jitter", true, "at a random place of a stratum of the weight, not in its middle"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const Samples samples =
          importance_samples(in[0], in[1], in[2], in[3], static_cast<int>(a.integer("samples")),
                             {in[4], in[5], static_cast<int>(a.integer("stream"))}, a.flag("jitter"));
      return {samples.depths, samples.deltas};
    },
});

}  // namespace

Samples importance_samples(Value depths, Value weight, Value near, Value far, int samples,
                           const RandomKey& key, bool jitter) {
  const Value drawn = depths.graph->record_one(ImportanceSamples(samples, key.stream, jitter),
                                               {depths, weight, near, far, key.seed, key.step});
  return {drawn, sample_intervals(drawn, far)};
}

}  // namespace vivant
