#include "ops/tiles.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct PackWeights final : Op {
  PackWeights(bool transposed, std::int64_t panel, Factors factors)
      : transposed(transposed), panel(panel), factors(factors) {}
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
    const std::int64_t width = panel > 0 ? panel : panel_width(e.n);
    return {{DType::real, {(e.n + width - 1) / width, e.taps * packed_rows(e.k), width}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &w = launch.in(0), &packed = launch.out();
    const Extents e = extents(w.shape());
    // A given panel is attention's, which runs on tiles alone, and has no limit of keys.
    const bool on_units =
        factors == Factors::by_mode &&
        (panel > 0 ? launch.matrix_tiles() && e.k >= least_bf16_channels : suits_bf16(launch, e.k));
    if (on_units) return pack_bf16(launch, w, packed, transposed, e.taps, e.k, e.n, launch.count_of(w));
    pack_fp32(launch, w, packed, transposed, e.taps, e.k, e.n, {packed.channels(), packed[1], packed[1]},
              launch.count_of(w));
  }
  const bool transposed;
  const std::int64_t panel;
  const Factors factors;
};

const RegisterOp register_pack_weights({
    .name = "pack_weights",
    .summary = "weights in panels of columns, the layout that the matrix kernels read",
    .inputs = {{"w", "[taps..., K, N]"}},
    .outputs = {{"packed", "[panels, taps * padded K, panel columns]"}},
    .attributes = {{"transposed", false,
                    "the weights of the data gradient: K and N change places, taps reverse"},
                   {"panel", 0, "columns of a panel; 0: chosen by the number of columns"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {pack_weights(in[0], a.flag("transposed"), a.integer("panel"))};
    },
});

std::string memo_name(bool transposed, std::int64_t panel, Factors factors) {
  return fmt::format("packed {} {} {}", transposed ? "transposed" : "", panel,
                     factors == Factors::fp32 ? "fp32" : "");
}

}  // namespace

void pack_fp32(Launch& launch, const Tensor& w, const Tensor& packed, bool transposed, std::int64_t taps,
               std::int64_t k, std::int64_t n, const Panels& panels, const Tensor& count) {
  Launch::Call call = launch.kernel("pack_weights.cl", "pack_weights", {{"TRANSPOSED", transposed ? 1 : 0}});
  call.args(w, packed, taps, k, n, panels.width, panels.rows, count);
  const std::size_t rows = static_cast<std::size_t>(panels.written), number = tiles(n, panels.width);
  if (transposed)
    call.run({rows, number, 1}, {16, 1, 1});
  else
    call.run({number, rows, 1}, {1, 16, 1});
}

void pack_bf16(Launch& launch, const Tensor& w, const Tensor& packed, bool transposed, std::int64_t taps,
               std::int64_t k, std::int64_t n, const Tensor& count) {
  const std::int64_t panel = packed.channels();
  launch.kernel("pack_weights.cl", "pack_weights_bf16", {{"TRANSPOSED", transposed ? 1 : 0}})
      .args(w, packed, taps, k, n, panel, count)
      .run({static_cast<std::size_t>(taps * packed_rows(k) / 2), tiles(n, panel), 1}, {16, 1, 1});
}

Value pack_weights(Value w, bool transposed, std::int64_t panel, Factors factors) {
  return w.graph->memoised(w, memo_name(transposed, panel, factors),
                           [&] { return w.graph->record_one(PackWeights(transposed, panel, factors), {w}); });
}

void use_packed_weights(Value w, Value packed, bool transposed) {
  w.graph->memoised(w, memo_name(transposed, 0, Factors::by_mode), [&] { return packed; });
}

}  // namespace vivant
