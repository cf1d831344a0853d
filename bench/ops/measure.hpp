#pragma once
#include <functional>
#include <string>

#include "vivant/runtime/device.hpp"

namespace vivant::bench {

/// What one run of some device work costs.
struct Cost {
  double seconds = 0;          ///< median over the repetitions, from the call until the device has finished
  double fastest_seconds = 0;  ///< of the fastest repetition
  double launches = 0, allocations = 0;  ///< kernels and buffers per run, as the device counts them
};

/// Measures `work`, which enqueues on the device, as a benchmark of the Google Benchmark library: wall time,
/// the wait for the device included, after a run that compiles kernels and touches the memory. `quick` takes
/// fewer and shorter repetitions.
Cost measure(Device& device, const std::string& name, const std::function<void()>& work, bool quick);

}  // namespace vivant::bench
