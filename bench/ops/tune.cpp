#include "bench/ops/tune.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "bench/ops/measure.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/ops/attention.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/linear.hpp"

namespace vivant::bench {
namespace {

constexpr double clearly_faster = 0.97;  // of the default tile's time
constexpr std::size_t finalists = 3;

/// A graph that does little but run one tiled kernel.
struct Work {
  Value input(const Shape& shape) {
    inputs.push_back(graph.input(fmt::format("input {}", inputs.size()), shape));
    return inputs.back();
  }
  void gradient_of(Value y, Value wrt) {
    outputs = differentiate(graph, {y}, {input(Shape(y.shape()))}, {wrt});
  }
  Graph graph;
  Values inputs, outputs;
};

void record_convolution(Work& work, TiledKernel kernel, std::int64_t columns) {
  // Winograd's algorithm takes multiples of 16 channels; 84 go tap by tap.
  const bool winograd =
      kernel == TiledKernel::conv2d_winograd || kernel == TiledKernel::conv2d_winograd_gradient;
  const std::int64_t channels = winograd ? 64 : 84, side = winograd ? 96 : 64;
  const Value x = work.input({side, side, channels}), w = work.input({3, 3, channels, columns});
  const Value y = conv2d(x, w);
  if (kernel == TiledKernel::conv2d || kernel == TiledKernel::conv2d_winograd)
    work.outputs = {y};
  else
    work.gradient_of(y, w);
}

void record_attention(Work& work) {
  const Shape shape = {1024, 128};
  const Value q = work.input(shape), k = work.input(shape), values = work.input(shape);
  const Value o = attend(q, k, values, {}, {.scale = 0.1});
  work.outputs = differentiate(work.graph, {o}, {work.input(shape)}, {q, k, values});
}

void record(Work& work, const TuneTask& task) {
  // Panels of 64 columns come with more than 64 columns most of the time.
  const std::int64_t columns = task.panel == 64 ? 128 : task.panel, rows = 16384, inner = 128;
  switch (task.kernel) {
    case TiledKernel::linear:
      work.outputs = {linear(work.input({rows, inner}), work.input({inner, columns}))};
      return;
    case TiledKernel::outer_sum:
      work.outputs = {outer_sum(work.input({rows, inner}), work.input({rows, columns}))};
      return;
    case TiledKernel::attention:
      return record_attention(work);
    default:
      return record_convolution(work, task.kernel, columns);
  }
}

/// Numbers between -0.5 and 0.5.
std::vector<float> numbers(std::int64_t count) {
  std::vector<float> data(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<float>(i % 251) / 250 - 0.5f;
  return data;
}

/// Puts the device's tiles back at the end.
class TilesGuard {
 public:
  explicit TilesGuard(Device& device) : device_(device), tiles_(device.tiles()) {}
  ~TilesGuard() { device_.use_tiles(tiles_); }
  TilesGuard(const TilesGuard&) = delete;
  TilesGuard& operator=(const TilesGuard&) = delete;

 private:
  Device& device_;
  const TileTable tiles_;
};

double seconds_of(Device& device, const TuneTask& task, const Tile& tile, bool quick) {
  TileTable tiles;
  tiles.set(task.kernel, task.panel, tile);
  device.use_tiles(tiles);
  Work work;
  record(work, task);
  Executor executor(device, work.graph, work.outputs);
  for (const Value& input : work.inputs)
    executor.write(input, std::span<const float>(numbers(input.elements())));
  const std::string name = fmt::format("tune/{}/{}", name_of(task.kernel), task.panel);
  return measure(
             device, name, [&] { executor.run(); }, quick)
      .fastest_seconds;
}

/// The tiles among the timings that are worth a second look: the fastest, and the default one.
std::vector<Tile> worth_another_look(std::vector<TileTiming> timings, const Tile& standard) {
  std::sort(timings.begin(), timings.end(),
            [](const TileTiming& a, const TileTiming& b) { return a.seconds < b.seconds; });
  std::vector<Tile> tiles = {standard};
  for (std::size_t i = 0; i < std::min(timings.size(), finalists); ++i)
    if (timings[i].tile != standard) tiles.push_back(timings[i].tile);
  return tiles;
}

}  // namespace

std::vector<TuneTask> tune_tasks(const Device& device, const std::string& filter, bool quick) {
  std::vector<TuneTask> tasks;
  for (const TiledKernel kernel : all_tiled_kernels) {
    if (name_of(kernel).find(filter) == std::string_view::npos) continue;
    for (const std::int64_t panel : {16, 32, 48, 64})
      if (!legal_tiles(kernel, device.device_class(), panel).empty() && (!quick || panel % 32 == 0))
        tasks.push_back({kernel, panel});
  }
  if (tasks.empty()) {
    std::vector<std::string_view> names;
    names.reserve(all_tiled_kernels.size());
    for (const TiledKernel kernel : all_tiled_kernels) names.push_back(name_of(kernel));
    throw UsageError(fmt::format("no kernel that '{}' names can be tuned on this device: there are {}",
                                 filter, fmt::join(names, ", ")));
  }
  return tasks;
}

Tuned choose(const std::vector<TileTiming>& timings, const Tile& standard) {
  const auto own = std::find_if(timings.begin(), timings.end(),
                                [&](const TileTiming& timing) { return timing.tile == standard; });
  if (own == timings.end()) fail("the default tile was not measured");
  const auto fastest =
      std::min_element(timings.begin(), timings.end(),
                       [](const TileTiming& a, const TileTiming& b) { return a.seconds < b.seconds; });
  return {*own, fastest->seconds < clearly_faster * own->seconds ? *fastest : *own};
}

Tuned tune(Device& device, const TuneTask& task, bool quick) {
  const TilesGuard guard(device);
  const Tile standard = default_tile(task.kernel, device.device_class(), task.panel);
  std::vector<TileTiming> timings;
  for (const Tile& tile : legal_tiles(task.kernel, device.device_class(), task.panel)) try {
      timings.push_back({tile, seconds_of(device, task, tile, true)});
    } catch (const Error&) {
      if (tile == standard) throw;  // another one may need more registers than the device has
    }
  if (!quick) {
    const std::vector<Tile> tiles = worth_another_look(timings, standard);
    timings.clear();
    for (const Tile& tile : tiles) timings.push_back({tile, seconds_of(device, task, tile, false)});
  }
  return choose(timings, standard);
}

}  // namespace vivant::bench
