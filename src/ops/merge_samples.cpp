#include "vivant/ops/merge_samples.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::array<std::size_t, 3> ray_group{16, 1, 1};

std::array<std::size_t, 3> ray_items(const Tensor& x) { return {static_cast<std::size_t>(x[0]), 1, 1}; }

void check_rays(std::string_view name, const Shape& a, const Shape& b) {
  if (a.rank() != 2 || b.rank() != 2 || a[0] != b[0])
    fail("[{}] {} and {} are not samples [R, A] and [R, B] of the same rays", name, a.text(), b.text());
}

struct MergeOrder final : Op {
  std::string_view name() const override { return "merge_order"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_rays(name(), in[0].shape, in[1].shape);
    return {{DType::i32, {in[0].shape[0], in[0].shape[1] + in[1].shape[1]}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &a = launch.in(0), &b = launch.in(1);
    launch.kernel("merge_samples.cl", "merge_order")
        .args(a, b, launch.out(), a[0], a[1], b[1])
        .run(ray_items(a), ray_group);
  }
  Values gradient(const GradientRequest&) const override { return {Value{}, Value{}}; }
};

struct MergeBy final : Op {
  std::string_view name() const override { return "merge_by"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_rays(name(), in[1].shape, in[2].shape);
    const Shape merged{in[1].shape[0], in[1].shape[1] + in[2].shape[1]};
    if (in[0].shape != merged)
      fail("[merge_by] the order is {}, the samples {}", in[0].shape.text(), merged.text());
    return {{DType::real, merged}};
  }
  void launch(Launch& launch) const override {
    const Tensor &a = launch.in(1), &b = launch.in(2);
    launch.kernel("merge_samples.cl", "merge_by")
        .args(launch.in(0), a, b, launch.out(), a[0], a[1], b[1])
        .run(ray_items(a), ray_group);
  }
  Values gradient(const GradientRequest& request) const override {
    const Split split = split_by(request.in[0], request.grad(), request.in[1].shape()[1]);
    return {Value{}, split.a, split.b};
  }
};

struct SplitBy final : Op {
  explicit SplitBy(std::int64_t a_count) : a_count(a_count) {}
  std::string_view name() const override { return "split_by"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& merged = in[1].shape;
    if (in[0].shape != merged)
      fail("[split_by] the order is {}, the samples {}", in[0].shape.text(), merged.text());
    if (a_count < 1 || a_count >= merged[1])
      fail("[split_by] {} of {} samples belong to the first field", a_count, merged[1]);
    return {{DType::real, {merged[0], a_count}}, {DType::real, {merged[0], merged[1] - a_count}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& merged = launch.in(1);
    launch.kernel("merge_samples.cl", "split_by")
        .args(launch.in(0), merged, launch.out(0), launch.out(1), merged[0], a_count, merged[1] - a_count)
        .run(ray_items(merged), ray_group);
  }
  Values gradient(const GradientRequest& request) const override {
    return {Value{}, merge_by(request.in[0], request.grad(0), request.grad(1))};
  }
  const std::int64_t a_count;
};

struct UnionDeltas final : Op {
  std::string_view name() const override { return "union_deltas"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.rank() != 2 || in[0].shape != in[1].shape)
      fail("[union_deltas] depths are {}, deltas {}", in[0].shape.text(), in[1].shape.text());
    return {in[0]};
  }
  void launch(Launch& launch) const override {
    const Tensor& depths = launch.in(0);
    launch.kernel("merge_samples.cl", "union_deltas")
        .args(depths, launch.in(1), launch.out(), depths[0], depths[1])
        .run(ray_items(depths), ray_group);
  }
  Values gradient(const GradientRequest&) const override { return {Value{}, Value{}}; }
};

const RegisterOp register_order({
    .name = "merge_order",
    .summary = "the order of two fields' samples by depth, ties to the first",
    .inputs = {{"depths_a", "[R, A], ascending"}, {"depths_b", "[R, B], ascending"}},
    .outputs = {{.name = "order", .shape = "[R, A + B]", .dtype = DType::i32}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {merge_order(in[0], in[1])};
    },
});
const RegisterOp register_merge({
    .name = "merge_by",
    .summary = "two fields' values in the merged order",
    .inputs = {{.name = "order", .shape = "[R, A + B]", .dtype = DType::i32},
               {"a", "[R, A]"},
               {"b", "[R, B]"}},
    .outputs = {{"merged", "[R, A + B]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {merge_by(in[0], in[1], in[2])};
    },
});
const RegisterOp register_split({
    .name = "split_by",
    .summary = "merged values back to their fields",
    .inputs = {{.name = "order", .shape = "[R, A + B]", .dtype = DType::i32}, {"merged", "[R, A + B]"}},
    .outputs = {{"a", "[R, A]"}, {"b", "[R, B]"}},
    .attributes = {{"a_count", 1, "A, the samples of the first field"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const Split split = split_by(in[0], in[1], a.integer("a_count"));
      return {split.a, split.b};
    },
});
const RegisterOp register_union({
    .name = "union_deltas",
    .summary = "intervals recomputed over the union of two fields' samples",
    .inputs = {{"depths", "[R, S], ascending"}, {"deltas", "[R, S]"}},
    .outputs = {{"deltas", "[R, S]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {union_deltas(in[0], in[1])};
    },
});

}  // namespace

Value merge_order(Value depths_a, Value depths_b) {
  return depths_a.graph->record_one(MergeOrder(), {depths_a, depths_b});
}
Value merge_by(Value order, Value a, Value b) { return order.graph->record_one(MergeBy(), {order, a, b}); }
Split split_by(Value order, Value merged, std::int64_t a_count) {
  const Values out = order.graph->record(std::make_shared<SplitBy>(a_count), {order, merged});
  return {out[0], out[1]};
}
Value union_deltas(Value depths, Value deltas) {
  return depths.graph->record_one(UnionDeltas(), {depths, deltas});
}

}  // namespace vivant
