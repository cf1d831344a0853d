#include "ops/conv2d_weight_gradient.hpp"

#include "ops/partials.hpp"
#include "ops/tiles.hpp"
#include "ops/winograd.hpp"

namespace vivant {
namespace {

constexpr std::int64_t taps = 9, points = 36, row_points = 6, block_tiles = 48;
constexpr std::int64_t most_channels = 1024;  // a work-item keeps a row of points of 48 tiles on its stack

struct Conv2dWeightGradient final : Op {
  Conv2dWeightGradient(int pad, bool reflect) : pad(pad), reflect(reflect) {}
  std::string_view name() const override { return "conv2d_weight_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override {
    return {{DType::real, {3, 3, in[0].shape.channels(), in[1].shape.channels()}}};
  }
  /// Output rows per chunk: both operands fit into the cache, and all partial sums into 16 MiB.
  static std::int64_t chunk_rows(const Shape& x, const Shape& grad) {
    const std::int64_t rows_in_cache = (1 << 17) / ((x[2] + grad[2]) * grad[1]);
    const std::int64_t most_chunks = (1 << 22) / (taps * x[2] * grad[2]);
    return chunk_length(grad[0], std::max<std::int64_t>(1, rows_in_cache),
                        std::clamp<std::int64_t>(most_chunks, 1, 128));
  }
  static std::int64_t chunks_of_rows(const Shape& x, const Shape& grad) {
    const std::int64_t rows = chunk_rows(x, grad);
    return (grad[0] + rows - 1) / rows;
  }

  /// By Winograd's algorithm (CPUs).
  static bool winograd(const Shape& x, const Shape& grad) {
    return x[2] % 16 == 0 && grad[2] % 16 == 0 && x[2] + grad[2] <= most_channels &&
           winograd_tiles(grad) >= block_tiles;
  }
  /// Input channels of a work-item, whose sums fit into the second cache.
  static std::int64_t block_channels(const Shape& x, const Shape& grad) {
    constexpr std::int64_t in_cache = 1 << 18;  // numbers: a MiB
    std::int64_t blocks = 1;
    while (x[2] % (16 * blocks) != 0 ||
           (row_points * x[2] / blocks * grad[2] > in_cache && x[2] > 16 * blocks))
      ++blocks;
    return x[2] / blocks;
  }
  /// Chunks of tiles: 256 tiles at least, and all partial sums in 16 MiB.
  static std::int64_t chunk_tiles(const Shape& x, const Shape& grad) {
    const std::int64_t most_chunks = std::clamp<std::int64_t>((1 << 22) / (points * x[2] * grad[2]), 1, 8);
    return (chunk_length(winograd_tiles(grad), 256, most_chunks) + block_tiles - 1) / block_tiles *
           block_tiles;
  }
  static std::int64_t chunks_of_tiles(const Shape& x, const Shape& grad) {
    const std::int64_t chunk = chunk_tiles(x, grad);
    return (winograd_tiles(grad) + chunk - 1) / chunk;
  }

  /// Partial sums, those of the form that needs more, and zeros: the pixels outside of pictures.
  TensorTypes workspaces(const TensorTypes& in) const override {
    const Shape &x = in[0].shape, &grad = in[1].shape;
    const std::int64_t rows = chunks_of_rows(x, grad) * taps,
                       tiles = winograd(x, grad) ? chunks_of_tiles(x, grad) * points : 0;
    return {{DType::real, {std::max(rows, tiles), x[2] * grad[2]}}, {DType::real, {std::max(x[2], grad[2])}}};
  }
  void launch(Launch& launch) const override {
    const std::int64_t m = launch.in(0)[2], n = launch.in(1)[2];
    if (launch.bf16() && std::min(m, n) >= least_bf16_channels && m + n <= most_channels)
      launch_bf16(launch);
    else
      winograd(launch.in(0).shape(), launch.in(1).shape()) && !launch.gpu() ? launch_winograd(launch)
                                                                            : launch_taps(launch);
  }
  void launch_bf16(Launch& launch) const {
    const Tensor &x = launch.in(0), &grad = launch.in(1), &partial = launch.workspace(0);
    const std::int64_t chunk = chunk_rows(x.shape(), grad.shape()), panel = panel_width(grad[2]);
    const std::int64_t span = std::min<std::int64_t>(128, (grad[1] + 31) / 32 * 32);
    const std::int64_t staged_rows = (1 << 17) / (x[2] * (span + 32) + grad[2] * span);
    launch
        .kernel("conv2d.cl", "conv2d_weight_gradient_bf16",
                {{"INNER", x[2]},
                 {"OUTER", grad[2]},
                 {"PANEL", panel},
                 {"TILE_VECTORS", panel / 16},
                 {"SPAN", span},
                 {"BLOCK_HEIGHT",
                  std::clamp<std::int64_t>(staged_rows - 1, 1, std::min<std::int64_t>(8, chunk))}})
        .args(x, grad, partial, x[0], x[1], grad[0], grad[1], pad, reflect ? 1 : 0, chunk)
        .run({static_cast<std::size_t>(chunks_of_rows(x.shape(), grad.shape())), 1, 1}, {1, 1, 1});
    sum_weight_partials(launch, partial, launch.out(), chunks_of_rows(x.shape(), grad.shape()), taps, x[2],
                        grad[2], false);
  }
  void launch_winograd(Launch& launch) const {
    const Tensor &x = launch.in(0), &grad = launch.in(1), &partial = launch.workspace(0),
                 &zeros = launch.workspace(1), &out = launch.out();
    const std::int64_t block = block_channels(x.shape(), grad.shape());
    Tile tile = choose_gradient_tile(launch, TiledKernel::conv2d_winograd_gradient, block, grad[2]);
    while (grad[2] / 16 % tile.vectors != 0) --tile.vectors;
    const Defines defines = {{"INNER", x[2]},        {"OUTER", grad[2]},
                             {"BLOCK", block},       {"TILE_ROWS", tile.rows},
                             {"TILES", block_tiles}, {"TILE_VECTORS", tile.vectors}};
    const std::int64_t chunks = chunks_of_tiles(x.shape(), grad.shape());
    launch.zero(zeros);
    launch.kernel("conv2d_winograd.cl", "conv2d_winograd_gradient", defines)
        .args(x, grad, zeros, partial, x[0], x[1], grad[0], grad[1], pad, reflect ? 1 : 0,
              chunk_tiles(x.shape(), grad.shape()))
        .run({row_points, tiles(x[2], block), static_cast<std::size_t>(chunks)}, {1, 1, 1});
    launch.kernel("conv2d_winograd.cl", "conv2d_winograd_weights", defines)
        .args(partial, out, chunks)
        .run({tiles(grad[2], 16), static_cast<std::size_t>(x[2]), 1}, {1, 1, 1});
  }
  void launch_taps(Launch& launch) const {
    const Tensor &x = launch.in(0), &grad = launch.in(1), &partial = launch.workspace(0);
    const bool swapped = vectors_suit_first(x[2], grad[2]);
    const std::int64_t m = swapped ? grad[2] : x[2], n = swapped ? x[2] : grad[2];
    const std::int64_t chunks = chunks_of_rows(x.shape(), grad.shape());
    const Tile tile = choose_gradient_tile(launch, TiledKernel::conv2d_weight_gradient, m, n);
    launch
        .kernel("conv2d.cl", "conv2d_weight_gradient",
                {{"TILE_ROWS", tile.rows}, {"TILE_VECTORS", tile.vectors}, {"SWAPPED", swapped ? 1 : 0}})
        .args(x, grad, partial, x[0], x[1], grad[0], grad[1], m, n, pad, reflect ? 1 : 0,
              chunk_rows(x.shape(), grad.shape()))
        .run({taps * tiles(m, tile.rows), tiles(n, tile.vectors * launch.vector_width()),
              static_cast<std::size_t>(chunks)},
             launch.gpu() ? std::array<std::size_t, 3>{8, 8, 1} : std::array<std::size_t, 3>{1, 1, 1});
    sum_weight_partials(launch, partial, launch.out(), chunks, taps, m, n, swapped);
  }
  double flops(const TensorTypes& in, const TensorTypes& out) const override {
    return 2.0 * static_cast<double>(in[1].shape.rows() * out[0].shape.elements());
  }
  const int pad;
  const bool reflect;
};

}  // namespace

Value conv2d_weight_gradient(Value x, Value grad, int pad, bool reflect) {
  return x.graph->record_one(Conv2dWeightGradient(pad, reflect), {x, grad});
}

}  // namespace vivant
