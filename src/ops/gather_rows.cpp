#include "ops/lanes.hpp"
#include "ops/partials.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::int64_t rows_per_item = 32;  // on CPUs

void check_ids(std::string_view op, const TensorType& ids) {
  if (ids.dtype != DType::i32 || ids.shape.elements() != ids.shape[0])
    fail("[{}] ids must be i32 [K] or [K, 1], they are {} {}", op, name_of(ids.dtype), ids.shape.text());
}

struct GatherRows final : Op {
  explicit GatherRows(IdOrder order) : order(order) {}
  std::string_view name() const override { return "gather_rows"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_ids(name(), in[1]);
    if (in[0].shape.rank() != 2) fail("[gather_rows] x must be [N, C], it is {}", in[0].shape.text());
    return {{DType::real, {in[1].shape[0], in[0].shape.channels()}, in[1].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &ids = launch.in(1);
    const Lanes lanes(launch, x.channels());
    const std::int64_t block = launch.gpu() ? 1 : rows_per_item;
    launch.kernel("gather_rows.cl", "gather_rows", lanes.defines())
        .args(x, ids, launch.out(), ids[0], block, launch.count_of(ids))
        .run(lanes.items(ids[0], block), lanes.group());
  }
  Values gradient(const GradientRequest& request) const override {
    const Value x = request.in[0], ids = request.in[1];
    const Value grad = request.graph.with_count(request.grad(), ids.count());
    return {request.graph.with_count(scatter_rows(grad, ids, x.shape()[0], order), x.count()), Value{}};
  }
  const IdOrder order;
};

struct ScatterRows final : Op {
  ScatterRows(std::int64_t rows, IdOrder order) : rows(rows), order(order) {}
  std::string_view name() const override { return "scatter_rows"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_ids(name(), in[1]);
    if (in[0].shape.rank() != 2 || in[0].shape[0] != in[1].shape[0])
      fail("[scatter_rows] x must have a row for each of the {} ids, it is {}", in[1].shape[0],
           in[0].shape.text());
    if (in[1].count >= 0 && in[1].count != in[0].count)
      fail("[scatter_rows] the ids have a device-side count that x does not have");
    return {{DType::real, {rows, in[0].shape.channels()}}};
  }
  /// How many ids a private copy takes: so many copies that they stay within 16 MiB.
  std::int64_t share(const Shape& x) const {
    const std::int64_t copies = std::clamp<std::int64_t>((1 << 22) / (rows * x.channels()), 1, 64);
    return chunk_length(x[0], 512, copies);
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    if (order == IdOrder::ascending) return {};
    const Shape& x = in[0].shape;
    return {{DType::real, {(x[0] + share(x) - 1) / share(x), rows * x.channels()}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &ids = launch.in(1);
    const Tensor count = launch.count_of(x);
    const Lanes lanes(launch, x.channels());
    if (order == IdOrder::ascending) {
      const std::int64_t block = launch.gpu() ? 1 : rows_per_item;
      launch.kernel("gather_rows.cl", "scatter_ascending", lanes.defines())
          .args(x, ids, launch.out(), rows, ids[0], block, count)
          .run(lanes.items(rows, block), lanes.group());
      return;
    }
    const Tensor& partial = launch.workspace();
    launch.kernel("gather_rows.cl", "scatter_any", lanes.defines())
        .args(x, ids, partial, rows, ids[0], share(x.shape()), partial[0], count)
        .run({static_cast<std::size_t>(lanes.vectors()), static_cast<std::size_t>(partial[0]), 1}, {1, 1, 1});
    reduce_partials(launch, partial, launch.out(), partial[0], rows * x.channels());
  }
  Values gradient(const GradientRequest& request) const override {
    Value ids = request.in[1];
    if (const Value count = request.in[0].count())  // ids behind the live rows say nothing
      ids = request.graph.with_count(request.graph.reshape(ids, {ids.elements(), 1}), count);
    return {gather_rows(request.grad(), ids, order), Value{}};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
  const std::int64_t rows;
  const IdOrder order;
};

IdOrder order_of(const Attributes& a) { return a.flag("ascending") ? IdOrder::ascending : IdOrder::any; }
const AttributeInfo ascending_info{"ascending", false, "whether the ids ascend, negative ones last"};

const RegisterOp register_gather_rows({
    .name = "gather_rows",
    .summary = "rows of a matrix by their ids",
    .inputs = {{"x", "[N, C]"}, {"ids", "[K]", DType::i32}},
    .outputs = {{"y", "[K, C]"}},
    .attributes = {ascending_info},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {gather_rows(in[0], in[1], order_of(a))};
    },
});
const RegisterOp register_scatter_rows({
    .name = "scatter_rows",
    .summary = "sums rows of the same id",
    .inputs = {{"x", "[K, C]"}, {"ids", "[K]", DType::i32}},
    .outputs = {{"y", "[rows, C]"}},
    .attributes = {{"rows", 1, "of the result"}, ascending_info},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {scatter_rows(in[0], in[1], a.integer("rows"), order_of(a))};
    },
});

}  // namespace

Value gather_rows(Value x, Value ids, IdOrder order) {
  return x.graph->record_one(GatherRows(order), {x, ids});
}
Value scatter_rows(Value x, Value ids, std::int64_t rows, IdOrder order) {
  return x.graph->record_one(ScatterRows(rows, order), {x, ids});
}

}  // namespace vivant
