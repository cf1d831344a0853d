#include "vivant/ops/concat.hpp"

#include "ops/rows.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// A range of columns in a tensor seen as a matrix.
struct Columns {
  std::int64_t columns, first;
};

void copy_columns(Launch& launch, const Tensor& from, Columns source, const Tensor& to, Columns target,
                  std::int64_t width, const Tensor& count) {
  const std::int64_t rows = from.elements() / source.columns;
  const std::size_t across = vectors(launch, width)[0];
  const bool wide = across > static_cast<std::size_t>(rows);
  launch.kernel("concat.cl", "copy_columns")
      .args(from, to, rows, source.columns, source.first, target.columns, target.first, width, count)
      .run({across, static_cast<std::size_t>(rows), 1}, wide ? std::array<std::size_t, 3>{64, 1, 1}
                                                        : launch.gpu()
                                                            ? std::array<std::size_t, 3>{8, 8, 1}
                                                            : std::array<std::size_t, 3>{1, 64, 1});
}

/// Which part of a tensor of `shape` a slice takes: as a matrix whose columns run over `axis` and all behind
/// it.
struct Range {
  Range(const Shape& whole, int axis, std::int64_t first, std::int64_t extent) {
    std::int64_t inner = 1;
    for (int i = axis + 1; i < whole.rank(); ++i) inner *= whole[i];
    in = {whole[axis] * inner, first * inner};
    width = extent * inner;
  }
  Columns in;
  std::int64_t width;
};

struct Slice final : Op {
  Slice(int axis, std::int64_t first, std::int64_t extent) : axis(axis), first(first), extent(extent) {}
  std::string_view name() const override { return "slice"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& x = in[0].shape;
    if (axis < 0 || axis >= x.rank()) fail("[slice] {} has no axis {}", x.text(), axis);
    if (first < 0 || extent < 1 || first + extent > x[axis])
      fail("[slice] the range [{}, {}) does not fit into axis {} of {}", first, first + extent, axis,
           x.text());
    if (in[0].count >= 0 && axis == 0)
      fail("[slice] the rows of {} have a count: slice its channels", x.text());
    std::vector<std::int64_t> extents = x.extents();
    extents[axis] = extent;
    return {{DType::real, Shape(extents), in[0].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    const Range range(x.shape(), axis, first, extent);
    copy_columns(launch, x, range.in, launch.out(), {range.width, 0}, range.width, launch.count_of(x));
  }
  Values gradient(const GradientRequest& request) const override;
  const int axis;
  const std::int64_t first, extent;
};

/// Zeros of `shape` with x at the place of a slice: the gradient of slice.
struct Embed final : Op {
  Embed(Shape shape, int axis, std::int64_t first) : shape(std::move(shape)), axis(axis), first(first) {}
  std::string_view name() const override { return "embed"; }
  TensorTypes infer(const TensorTypes& in) const override { return {{DType::real, shape, in[0].count}}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    const Range range(shape, axis, first, x[axis]);
    launch.zero(launch.out());
    copy_columns(launch, x, {range.width, 0}, launch.out(), range.in, range.width, launch.count_of(x));
  }
  Values gradient(const GradientRequest& request) const override {
    return {slice(request.grad(), axis, first, request.in[0].shape()[axis])};
  }
  const Shape shape;
  const int axis;
  const std::int64_t first;
};

Values Slice::gradient(const GradientRequest& request) const {
  return {request.graph.record_one(Embed(request.in[0].shape(), axis, first), {request.grad()})};
}

struct Concat final : Op {
  std::string_view name() const override { return "concat"; }
  TensorTypes infer(const TensorTypes& in) const override {
    std::int64_t channels = 0;
    for (const TensorType& part : in) {
      channels += part.shape.channels();
      if (part.shape.with_channels(1) != in[0].shape.with_channels(1) || part.count != in[0].count)
        fail("[concat] {} does not go beside {}", part.shape.text(), in[0].shape.text());
    }
    return {{DType::real, in[0].shape.with_channels(channels), in[0].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& y = launch.out();
    std::int64_t first = 0;
    for (const Tensor& x : launch.inputs) {
      copy_columns(launch, x, {x.channels(), 0}, y, {y.channels(), first}, x.channels(), launch.count_of(x));
      first += x.channels();
    }
  }
  Values gradient(const GradientRequest& request) const override {
    Values grads;
    std::int64_t first = 0;
    for (std::size_t i = 0; i < request.in.size(); ++i) {
      const std::int64_t channels = request.in[i].shape().channels();
      grads.push_back(request.needed[i] ? slice(request.grad(), -1, first, channels) : Value{});
      first += channels;
    }
    return grads;
  }
};

const RegisterOp register_concat({
    .name = "concat",
    .summary = "joins tensors along the channels",
    .inputs = {{"a", "[..., C1]"}, {"b", "[..., C2]"}, {.name = "c", .shape = "[..., C3]", .optional = true}},
    .outputs = {{"y", "[..., C1 + C2 + C3]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {concat(in[2] ? in : Values{in[0], in[1]})};
    },
});
const RegisterOp register_slice({
    .name = "slice",
    .summary = "a range of one axis",
    .inputs = {{"x", "[..., C]"}},
    .outputs = {{"y", "[..., extent]"}},
    .attributes = {{"axis", -1, "negative: from the end"}, {"first", 0, "start"}, {"extent", 1, "length"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {slice(in[0], static_cast<int>(a.integer("axis")), a.integer("first"), a.integer("extent"))};
    },
});

}  // namespace

Value concat(const Values& parts) {
  if (parts.empty()) fail("[concat] there is nothing to join");
  return parts[0].graph->record_one(Concat(), parts);
}

Value slice(Value x, int axis, std::int64_t first, std::int64_t extent) {
  return x.graph->record_one(Slice(axis < 0 ? axis + x.shape().rank() : axis, first, extent), {x});
}

}  // namespace vivant
