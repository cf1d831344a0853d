#include "vivant/ops/peak_depth.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct PeakDepth final : Op {
  std::string_view name() const override { return "peak_depth"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& weight = in[0].shape;
    if (weight.rank() != 2) fail("[peak_depth] weight must be [rays, samples], it is {}", weight.text());
    if (in[1].shape != weight)
      fail("[peak_depth] depths is {}, weight {}", in[1].shape.text(), weight.text());
    return {{DType::real, {weight[0], 1}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& weight = launch.in(0);
    launch.kernel("peak_depth.cl", "peak_depth")
        .args(weight, launch.in(1), launch.out(), weight[0], weight[1])
        .run({static_cast<std::size_t>(weight[0]), 1, 1}, {launch.gpu() ? std::size_t{64} : 1, 1, 1});
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
};

const RegisterOp register_peak_depth({
    .name = "peak_depth",
    .summary = "the depth of each ray where its samples weigh most",
    .inputs = {{"weight", "[R, S]"}, {"depths", "[R, S]"}},
    .outputs = {{"depth", "[R, 1]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values { return {peak_depth(in[0], in[1])}; },
});

}  // namespace

Value peak_depth(Value weight, Value depths) {
  return weight.graph->record_one(PeakDepth(), {weight, depths});
}

}  // namespace vivant
