#include "ops/rows.hpp"
#include "vivant/ops/attention.hpp"
#include "vivant/ops/concat.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/mean_variance_norm.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// Inputs: o [N, 2 C], deviation, gradients of mean and deviation.
struct AttentionStatisticsGradient final : Op {
  std::string_view name() const override { return "attention_statistics_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  void launch(Launch& launch) const override {
    const Tensor& deviation = launch.in(1);
    auto call = launch.kernel("attention_statistics.cl", "attention_statistics_gradient");
    call.args(launch.in(0), deviation, launch.in(2), launch.in(3), launch.out(), deviation.rows(),
              deviation.channels());
    run_over_rows(call, launch, deviation.rows(), deviation.channels());
  }
};

/// Inputs: o [N, 2 C] = A [u, u^2], the center [C] that u is relative to. Outputs: mean, deviation [N, C].
struct AttentionStatisticsOp final : Op {
  std::string_view name() const override { return "attention_statistics"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const TensorType half{DType::real, in[0].shape.with_channels(in[0].shape.channels() / 2)};
    return {half, half};
  }
  void launch(Launch& launch) const override {
    const Tensor& mean = launch.out(0);
    auto call = launch.kernel("attention_statistics.cl", "attention_statistics",
                              {{"SPLIT_PRODUCTS", launch.matrix_tiles() ? 1 : 0}});
    call.args(launch.in(0), launch.in(1), mean, launch.out(1), mean.rows(), mean.channels());
    run_over_rows(call, launch, mean.rows(), mean.channels());
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(AttentionStatisticsGradient(),
                                     {request.in[0], request.out[1], request.grad(0), request.grad(1)}),
            Value{}};
  }
};

const RegisterOp register_attention({
    .name = "attention",
    .summary = "mean and deviation of the values that each query attends to (AdaAttN)",
    .inputs = {{"q", "[N, D]"},
               {"k", "[M, D]"},
               {"v", "[M, C]"},
               {.name = "bias", .shape = "[M]", .optional = true}},
    .outputs = {{"mean", "[N, C]"}, {"deviation", "[N, C]"}},
    .attributes = {{"cosine", false, "weights q . k + 1 of unit vectors instead of softmax"},
                   {"scale", 1.0, "factor of q . k"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const AttentionStatistics result =
          attention(in[0], in[1], in[2], in[3], {a.flag("cosine"), a.number("scale")});
      return {result.mean, result.deviation};
    },
});

}  // namespace

AttentionStatistics attention(Value q, Value k, Value v, Value bias, const AttentionOptions& options) {
  Graph& graph = *q.graph;
  // The result does not depend on the center, so no gradient goes through it.
  const Value center = v.shape().rows() > 1 ? graph.detach(channel_statistics(v).mean)
                                            : graph.zeros({DType::real, {v.shape().channels()}});
  const Value u = subtract(v, center);
  const Value o = attend(q, k, concat({u, multiply(u, u)}), bias, options);
  const Values out = graph.record(std::make_shared<AttentionStatisticsOp>(), {o, center});
  return {out[0], out[1]};
}

}  // namespace vivant
