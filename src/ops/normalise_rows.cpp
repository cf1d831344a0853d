#include "vivant/graph/launch.hpp"
#include "vivant/ops/attention.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr double epsilon = 1e-12;

/// Inputs: x; or x and the gradient of y, for the gradient of x.
struct NormaliseRows final : Op {
  explicit NormaliseRows(bool backward) : backward(backward) {}
  std::string_view name() const override { return backward ? "normalise_rows_gradient" : "normalise_rows"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    auto call = launch.kernel("normalise_rows.cl", backward ? "normalise_rows_gradient" : "normalise_rows");
    call.args(x);
    if (backward) call.args(launch.in(1));
    call.args(launch.out(), x.rows(), x.channels(), epsilon, launch.count_of(x));
    call.run({static_cast<std::size_t>(x.rows()), 1, 1}, {16, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    if (backward) return Op::gradient(request);
    return {request.graph.record_one(NormaliseRows(true), {request.in[0], request.grad()})};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 3.0 * static_cast<double>(in[0].shape.elements());
  }
  const bool backward;
};

const RegisterOp register_normalise_rows({
    .name = "normalise_rows",
    .summary = "rows scaled to length 1",
    .inputs = {{"x", "[..., C]"}},
    .outputs = {{"y", "[..., C]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values { return {normalise_rows(in[0])}; },
});

}  // namespace

Value normalise_rows(Value x) { return x.graph->record_one(NormaliseRows(false), {x}); }

}  // namespace vivant
