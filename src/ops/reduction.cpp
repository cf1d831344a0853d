#include "vivant/ops/reduction.hpp"

#include "ops/partials.hpp"
#include "ops/rows.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::array<std::size_t, 3> row_group{64, 1, 1};

std::array<std::size_t, 3> row_items(const Tensor& x) { return {static_cast<std::size_t>(x.rows()), 1, 1}; }

struct SumRows final : Op {
  std::string_view name() const override { return "sum_rows"; }
  TensorTypes infer(const TensorTypes& in) const override {
    return {{DType::real, {in[0].shape.channels()}}};
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real, {chunks_of(in[0].shape.rows()), in[0].shape.channels()}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    const std::int64_t chunks = chunks_of(x.rows()), width = launch.vector_width();
    const std::size_t columns = static_cast<std::size_t>((x.channels() + width - 1) / width);
    launch.kernel("reduction.cl", "sum_rows_partial")
        .args(x, launch.workspace(), x.rows(), x.channels(), chunk_length(x.rows()), launch.count_of(x))
        .run({static_cast<std::size_t>(chunks), columns, 1}, {1, 1, 1});
    reduce_partials(launch, launch.workspace(), launch.out(), chunks, x.channels());
  }
  Values gradient(const GradientRequest& request) const override {
    return {broadcast_row(request.grad(), request.in[0].shape(), request.in[0].count())};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
};

struct Sum final : Op {
  std::string_view name() const override { return "sum"; }
  TensorTypes infer(const TensorTypes&) const override { return {{DType::real, {1}}}; }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real, {chunks_of(in[0].shape.elements())}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    const std::int64_t chunks = chunks_of(x.elements());
    launch.kernel("reduction.cl", "sum_flat_partial")
        .args(x, launch.workspace(), x.rows(), x.channels(), chunk_length(x.elements()), launch.count_of(x))
        .run({static_cast<std::size_t>(chunks), 1, 1}, {1, 1, 1});
    reduce_partials(launch, launch.workspace(), launch.out(), chunks, 1);
  }
  Values gradient(const GradientRequest& request) const override {
    const Value x = request.in[0];
    const Value row = broadcast_channels(request.graph.reshape(request.grad(), {1, 1}), x.shape().channels());
    return {broadcast_row(request.graph.reshape(row, {x.shape().channels()}), x.shape(), x.count())};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
};

struct SumGroups final : Op {
  explicit SumGroups(std::int64_t groups) : groups(groups) {}
  std::string_view name() const override { return "sum_groups"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.rows() % groups != 0)
      fail("[sum_groups] {} rows do not divide into {} groups", in[0].shape.rows(), groups);
    return {{DType::real, {groups, in[0].shape.channels()}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    const std::int64_t width = launch.vector_width();
    launch.kernel("reduction.cl", "sum_groups")
        .args(x, launch.out(), groups, x.rows() / groups, x.channels())
        .run({static_cast<std::size_t>(groups), static_cast<std::size_t>((x.channels() + width - 1) / width),
              1},
             {8, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    const Shape& shape = request.in[0].shape();
    return {request.graph.reshape(repeat_rows(request.grad(), shape.rows() / groups), shape)};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
  const std::int64_t groups;
};

struct RepeatRows final : Op {
  explicit RepeatRows(std::int64_t times) : times(times) {}
  std::string_view name() const override { return "repeat_rows"; }
  TensorTypes infer(const TensorTypes& in) const override {
    return {{DType::real, {in[0].shape.rows() * times, in[0].shape.channels()}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("reduction.cl", "repeat_rows")
        .args(x, launch.out(), x.rows(), times, x.channels())
        .run({static_cast<std::size_t>(x.rows() * times), 1, 1}, row_group);
  }
  Values gradient(const GradientRequest& request) const override {
    const Shape& shape = request.in[0].shape();
    return {request.graph.reshape(sum_groups(request.grad(), shape.rows()), shape)};
  }
  const std::int64_t times;
};

struct SumChannels final : Op {
  std::string_view name() const override { return "sum_channels"; }
  TensorTypes infer(const TensorTypes& in) const override {
    return {{DType::real, in[0].shape.with_channels(1), in[0].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("reduction.cl", "sum_channels")
        .args(x, launch.out(), x.rows(), x.channels(), launch.count_of(x))
        .run(row_items(x), row_group);
  }
  Values gradient(const GradientRequest& request) const override {
    return {broadcast_channels(request.grad(), request.in[0].shape().channels())};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
};

struct BroadcastRow final : Op {
  BroadcastRow(Shape shape, int count) : shape(std::move(shape)), count(count) {}
  std::string_view name() const override { return "broadcast_row"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.elements() != shape.channels())
      fail("[broadcast_row] {} is not one row of {}", in[0].shape.text(), shape.text());
    return {{DType::real, shape, count}};
  }
  void launch(Launch& launch) const override {
    const Tensor& y = launch.out();
    launch.kernel("reduction.cl", "broadcast_row")
        .args(launch.in(0), y, y.rows(), y.channels(), launch.count_of(y))
        .run(row_items(y), row_group);
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.reshape(sum_rows(request.grad()), request.in[0].shape())};
  }
  const Shape shape;
  const int count;
};

struct BroadcastChannels final : Op {
  explicit BroadcastChannels(std::int64_t channels) : channels(channels) {}
  std::string_view name() const override { return "broadcast_channels"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.channels() != 1)
      fail("[broadcast_channels] {} has more than one channel", in[0].shape.text());
    return {{DType::real, in[0].shape.with_channels(channels), in[0].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& y = launch.out();
    launch.kernel("reduction.cl", "broadcast_channels")
        .args(launch.in(0), y, y.rows(), y.channels(), launch.count_of(y))
        .run(row_items(y), row_group);
  }
  Values gradient(const GradientRequest& request) const override { return {sum_channels(request.grad())}; }
  const std::int64_t channels;
};

OpInfo reduction_info(const std::string& name, const std::string& summary, const std::string& output,
                      Value (*function)(Value)) {
  return {.name = name,
          .summary = summary,
          .inputs = {{"x", "[..., C]"}},
          .outputs = {{"y", output}},
          .attributes = {},
          .build = [function](Graph&, const Values& in, const Attributes&) -> Values {
            return {function(in[0])};
          }};
}
const RegisterOp register_sum_rows(reduction_info("sum_rows", "sums over all rows", "[C]", sum_rows));
const RegisterOp register_sum_channels(reduction_info("sum_channels", "sums over the channels", "[..., 1]",
                                                      sum_channels));
const RegisterOp register_sum(reduction_info("sum", "the sum of all elements", "[1]", sum));
const RegisterOp register_sum_groups({
    .name = "sum_groups",
    .summary = "sums over runs of neighbouring rows",
    .inputs = {{"x", "[..., C]"}},
    .outputs = {{"y", "[groups, C]"}},
    .attributes = {{"groups", 1, "number of runs"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {sum_groups(in[0], a.integer("groups"))};
    },
});
const RegisterOp register_mean(reduction_info("mean", "the mean of all elements", "[1]", mean));

}  // namespace

void reduce_partials(Launch& launch, const Tensor& partials, const Tensor& y, std::int64_t chunks,
                     std::int64_t n) {
  launch.kernel("reduction.cl", "reduce_partials")
      .args(partials, y, chunks, n)
      .run(vectors(launch, n), vector_group());
}

Value sum_rows(Value x) {
  if (x.shape().channels() == 1) return sum(x);
  return x.graph->record_one(SumRows(), {x});
}
Value sum_groups(Value x, std::int64_t groups) {
  if (groups == 1) return x.graph->reshape(sum_rows(x), {1, x.shape().channels()});
  return x.graph->record_one(SumGroups(groups), {x});
}
Value repeat_rows(Value x, std::int64_t times) { return x.graph->record_one(RepeatRows(times), {x}); }
Value sum_channels(Value x) { return x.graph->record_one(SumChannels(), {x}); }
Value sum(Value x) { return x.graph->record_one(Sum(), {x}); }
Value mean(Value x) {
  if (x.count()) fail("[mean] a value with a device-side count of rows has no fixed number of elements");
  return affine(sum(x), 1.0 / static_cast<double>(x.elements()));
}
Value broadcast_row(Value row, Shape shape, Value count) {
  return row.graph->record_one(BroadcastRow(std::move(shape), count ? count.id : -1), {row});
}
Value broadcast_channels(Value x, std::int64_t channels) {
  return x.graph->record_one(BroadcastChannels(channels), {x});
}

}  // namespace vivant
