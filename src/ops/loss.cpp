#include "vivant/ops/loss.hpp"

#include "ops/partials.hpp"
#include "ops/rows.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

enum class Kind { l1, l2, hard };

std::string_view loss_name(Kind kind) {
  return kind == Kind::l1 ? "l1_loss" : kind == Kind::l2 ? "l2_loss" : "hard_loss";
}

Defines defines_for(Kind kind, const Tensor& weights) {
  return {{"LOSS", static_cast<int>(kind)}, {"WEIGHTED", weights ? 1 : 0}};
}

/// Inputs: x, target, weights, the gradient of the loss.
struct LossGradient final : Op {
  explicit LossGradient(Kind kind) : kind(kind) {}
  std::string_view name() const override { return "loss_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &weights = launch.in(2);
    launch.kernel("loss.cl", "loss_gradient", defines_for(kind, weights))
        .args(x, launch.in(1), weights, launch.in(3), launch.out(), x.rows(), x.channels(),
              launch.count_of(x))
        .run(vectors(launch, x.elements()), vector_group());
  }
  const Kind kind;
};

/// Inputs: x, target (absent for the hard loss), weights or absent.
struct Loss final : Op {
  explicit Loss(Kind kind) : kind(kind) {}
  std::string_view name() const override { return loss_name(kind); }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& x = in[0].shape;
    if (kind != Kind::hard && in[1].shape != x)
      fail("[{}] x is {}, the target {}", name(), x.text(), in[1].shape.text());
    if (in[2].shape.rank() > 0 && in[2].shape.elements() != x.rows())
      fail("[{}] the weights {} are not one per row of {}", name(), in[2].shape.text(), x.text());
    return {{DType::real, {1}}};
  }
  bool accepts_counts() const override { return true; }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real, {chunks_of(in[0].shape.elements())}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &weights = launch.in(2), &partial = launch.workspace();
    launch.kernel("loss.cl", "loss_partial", defines_for(kind, weights))
        .args(x, launch.in(1), weights, partial, x.rows(), x.channels(), chunk_length(x.elements()),
              launch.count_of(x))
        .run({static_cast<std::size_t>(partial.elements()), 1, 1}, {1, 1, 1});
    launch.kernel("loss.cl", "loss_mean", defines_for(kind, weights))
        .args(partial, launch.out(), partial.elements(), x.rows(), x.channels(), launch.count_of(x))
        .run({1, 1, 1}, {1, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    const Values& in = request.in;
    const Value to_x = request.graph.record_one(LossGradient(kind), {in[0], in[1], in[2], request.grad()});
    Values grads(3);
    if (request.needed[0]) grads[0] = to_x;
    if (request.needed[1]) grads[1] = affine(to_x, -1);  // every f with a target takes x - target
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 3.0 * static_cast<double>(in[0].shape.elements());
  }
  const Kind kind;
};

OpInfo loss_info(Kind kind, const std::string& summary) {
  return {.name = std::string(loss_name(kind)),
          .summary = summary,
          .inputs = {{"x", "[..., C]"},
                     {"target", "[..., C]"},
                     {.name = "weights", .shape = "[..., 1]", .optional = true}},
          .outputs = {{"loss", "[1]"}},
          .attributes = {},
          .build = [kind](Graph& graph, const Values& in, const Attributes&) -> Values {
            return {graph.record_one(Loss(kind), in)};
          }};
}
const RegisterOp register_l1(loss_info(Kind::l1, "mean |x - target|"));
const RegisterOp register_l2(loss_info(Kind::l2, "mean (x - target)^2"));
const RegisterOp register_hard({
    .name = "hard_loss",
    .summary = "mean of log(1 + e^-1) - log(e^-|w| + e^-|1 - w|)",
    .inputs = {{"w", "[..., C]"}},
    .outputs = {{"loss", "[1]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values { return {hard_loss(in[0])}; },
});

}  // namespace

Value l1_loss(Value x, Value target, Value weights) {
  return x.graph->record_one(Loss(Kind::l1), {x, target, weights});
}
Value l2_loss(Value x, Value target, Value weights) {
  return x.graph->record_one(Loss(Kind::l2), {x, target, weights});
}
Value hard_loss(Value w) { return w.graph->record_one(Loss(Kind::hard), {w, Value{}, Value{}}); }

}  // namespace vivant
