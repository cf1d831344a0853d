#include "vivant/graph/launch.hpp"
#include "vivant/ops/human_samples.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// y and ids -> x, with the count of the input that y was made from.
struct GatherRows final : Op {
  explicit GatherRows(int count) : count(count) {}
  std::string_view name() const override { return "gather_rows"; }
  TensorTypes infer(const TensorTypes& in) const override {
    return {{DType::real, {in[1].shape.elements(), in[0].shape.channels()}, count}};
  }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.out();
    launch.kernel("scatter_rows.cl", "gather_rows")
        .args(launch.in(0), launch.in(1), x, x[0], x.channels(), launch.count_of(x))
        .run({static_cast<std::size_t>(x.elements()), 1, 1}, {64, 1, 1});
  }
  const int count;
};

struct ScatterRows final : Op {
  explicit ScatterRows(std::int64_t rows) : rows(rows) {}
  std::string_view name() const override { return "scatter_rows"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.rank() != 2 || in[1].dtype != DType::i32 || in[1].shape.elements() != in[0].shape[0])
      fail("[scatter_rows] rows {} do not fit ids {} {}", in[0].shape.text(), name_of(in[1].dtype),
           in[1].shape.text());
    return {{DType::real, {rows, in[0].shape[1]}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.zero(launch.out());
    launch.kernel("scatter_rows.cl", "scatter_rows")
        .args(x, launch.in(1), launch.out(), x[0], x.channels(), launch.count_of(x))
        .run({static_cast<std::size_t>(x.elements()), 1, 1}, {64, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(GatherRows(request.in[0].type().count), {request.grad(), request.in[1]}),
            Value{}};
  }
  const std::int64_t rows;
};

const RegisterOp registration({
    .name = "scatter_rows",
    .summary = "rows put at given places of a larger tensor, zeros elsewhere",
    .inputs = {{"x", "[N, C]"}, {"ids", "[N]", DType::i32}},
    .outputs = {{"y", "[rows, C]"}},
    .attributes = {{"rows", 1, "rows of the result"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {scatter_rows(in[0], in[1], a.integer("rows"))};
    },
});

}  // namespace

Value scatter_rows(Value x, Value ids, std::int64_t rows) {
  return x.graph->record_one(ScatterRows(rows), {x, ids});
}

}  // namespace vivant
