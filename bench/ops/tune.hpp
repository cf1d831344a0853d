#pragma once
#include <string>
#include <vector>

#include "vivant/runtime/device.hpp"

namespace vivant::bench {

/// What one tile took, the fastest repetition.
struct TileTiming {
  Tile tile;
  double seconds = 0;
};

/// The tile that is to be used, and what it gains.
struct Tuned {
  TileTiming standard;  ///< the default tile
  TileTiming chosen;    ///< the same where no other one is clearly faster
};

/// A kernel with weights in panels of `panel` columns.
struct TuneTask {
  TiledKernel kernel;
  std::int64_t panel;
};

/// What can be tuned on the device, kernels with `filter` in their name. `quick`: the panels of 32 and of 64
/// columns alone. Throws UsageError when there is none.
std::vector<TuneTask> tune_tasks(const Device& device, const std::string& filter, bool quick);

/// The fastest of the timings; the default one unless another is at least 3 % faster, so that noise chooses
/// nothing. Throws Error when `timings` holds no default tile.
Tuned choose(const std::vector<TileTiming>& timings, const Tile& standard);

/// Measures all tiles of a task, on shapes that training and rendering meet, and those that come first more
/// thoroughly, unless `quick`. The device's tiles are afterwards what they were before.
Tuned tune(Device& device, const TuneTask& task, bool quick);

}  // namespace vivant::bench
