#include "ops/tiles.hpp"
#include "ops/winograd.hpp"
#include "vivant/ops/conv2d.hpp"

namespace vivant {
namespace {

constexpr std::int64_t least_tiles = 16;      // fewer do not pay for four times the weights
constexpr std::int64_t most_channels = 1024;  // a work-item keeps 12 transformed tiles on its stack
constexpr std::int64_t points = 36;

struct PackWinograd final : Op {
  explicit PackWinograd(bool transposed) : transposed(transposed) {}
  std::string_view name() const override { return "pack_winograd"; }

  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& w = in[0].shape;
    if (w.rank() != 4 || w[0] != 3 || w[1] != 3)
      fail("[pack_winograd] weights {} are not [3, 3, K, N]", w.text());
    const std::int64_t k = w[transposed ? 3 : 2], n = w[transposed ? 2 : 3], panel = panel_width(n);
    return {{DType::real, {(n + panel - 1) / panel, points * k, panel}}};
  }
  /// On GPUs and for the tiles of matrix units the panels of pack_weights, in the first rows: conv2d's form
  /// there takes the taps one by one.
  void launch(Launch& launch) const override {
    const Tensor &w = launch.in(0), &packed = launch.out();
    const std::int64_t k = w[transposed ? 3 : 2], n = w[transposed ? 2 : 3];
    const auto panels = static_cast<std::size_t>(packed[0]);
    if (launch.matrix_tiles())
      pack_bf16(launch, w, packed, transposed, 9, k, n, {});
    else if (launch.gpu())
      pack_fp32(launch, w, packed, transposed, 9, k, n, {packed.channels(), packed[1], 9 * k}, {});
    else
      launch.kernel("pack_winograd.cl", "pack_winograd", {{"TRANSPOSED", transposed ? 1 : 0}})
          .args(w, packed, k, n, packed.channels())
          .run({static_cast<std::size_t>(k), panels, 1}, {1, 1, 1});
  }
  const bool transposed;
};

std::string memo_name(bool transposed) { return transposed ? "winograd transposed" : "winograd"; }

}  // namespace

bool suits_winograd(const Shape& w, bool transposed, std::int64_t height, std::int64_t width) {
  if (w.rank() != 4 || w[0] != 3 || w[1] != 3) return false;
  const std::int64_t k = w[transposed ? 3 : 2], n = w[transposed ? 2 : 3];
  return k % 16 == 0 && k <= most_channels && n >= 16 && winograd_tiles(height, width) >= least_tiles;
}

Value pack_winograd(Value w, bool transposed) {
  return w.graph->memoised(w, memo_name(transposed),
                           [&] { return w.graph->record_one(PackWinograd(transposed), {w}); });
}

void use_packed_winograd(Value w, Value packed, bool transposed) {
  w.graph->memoised(w, memo_name(transposed), [&] { return packed; });
}

}  // namespace vivant
