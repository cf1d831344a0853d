#include "vivant/ops/place_rows.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// Inputs: x (for its shape and count), ids, grad_y.
struct PlaceRowsGradient final : Op {
  std::string_view name() const override { return "place_rows_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("place_rows.cl", "place_rows_gradient")
        .args(launch.in(2), launch.in(1), launch.out(), x.rows(), x.channels(), launch.count_of(x))
        .run({static_cast<std::size_t>(x.rows()), 1, 1}, {64, 1, 1});
  }
};

struct PlaceRows final : Op {
  explicit PlaceRows(std::int64_t rows) : rows(rows) {}
  std::string_view name() const override { return "place_rows"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &x = in[0].shape, &ids = in[1].shape;
    if (x.rank() != 2) fail("[place_rows] x {} is no matrix", x.text());
    if (in[1].dtype != DType::i32 || ids.elements() != x[0])
      fail("[place_rows] ids must be i32, one for each of the {} rows, they are {} {}", x[0],
           name_of(in[1].dtype), ids.text());
    return {{DType::real, {rows, x[1]}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.zero(launch.out());
    launch.kernel("place_rows.cl", "place_rows")
        .args(x, launch.in(1), launch.out(), x.rows(), x.channels(), launch.count_of(x))
        .run({static_cast<std::size_t>(x.rows()), 1, 1}, {64, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(PlaceRowsGradient(), {request.in[0], request.in[1], request.grad()}),
            Value{}};
  }
  const std::int64_t rows;
};

const RegisterOp register_place_rows({
    .name = "place_rows",
    .summary = "rows at their places in a larger tensor, zeros elsewhere",
    .inputs = {{"x", "[N, C]"}, {"ids", "[N]", DType::i32}},
    .outputs = {{"y", "[rows, C]"}},
    .attributes = {{"rows", 1, "rows of y"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {place_rows(in[0], in[1], a.integer("rows"))};
    },
});

}  // namespace

Value place_rows(Value x, Value ids, std::int64_t rows) {
  return x.graph->record_one(PlaceRows(rows), {x, ids});
}

}  // namespace vivant
