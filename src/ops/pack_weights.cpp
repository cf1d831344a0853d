#include "ops/rows.hpp"
#include "ops/tiles.hpp"
#include "vivant/ops/linear.hpp"

namespace vivant {
namespace {

struct PackWeights final : Op {
  explicit PackWeights(bool transposed) : transposed(transposed) {}
  std::string_view name() const override { return "pack_weights"; }

  struct Extents {
    std::int64_t taps, k, n;
  };
  Extents extents(const Shape& w) const {
    const std::int64_t k = w[-2], n = w[-1], taps = w.elements() / (k * n);
    return transposed ? Extents{taps, n, k} : Extents{taps, k, n};
  }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.rank() < 2) fail("[pack_weights] weights {} are no matrix", in[0].shape.text());
    const Extents e = extents(in[0].shape);
    const std::int64_t panel = panel_width(e.n);
    return {{DType::real, {(e.n + panel - 1) / panel, e.taps * e.k, panel}}};
  }
  void launch(Launch& launch) const override {
    const Extents e = extents(launch.in(0).shape());
    const Tensor& packed = launch.out();
    launch.kernel("pack_weights.cl", "pack_weights", {{"TRANSPOSED", transposed ? 1 : 0}})
        .args(launch.in(0), packed, e.taps, e.k, e.n, packed.channels(), packed.elements())
        .run({static_cast<std::size_t>(packed.elements()), 1, 1}, {256, 1, 1});
  }
  const bool transposed;
};

std::string memo_name(bool transposed) { return transposed ? "packed transposed" : "packed"; }

}  // namespace

Value pack_weights(Value w, bool transposed) {
  return w.graph->memoised(w, memo_name(transposed),
                           [&] { return w.graph->record_one(PackWeights(transposed), {w}); });
}

void use_packed_weights(Value w, Value packed, bool transposed) {
  w.graph->memoised(w, memo_name(transposed), [&] { return packed; });
}

}  // namespace vivant
