#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "cases/op_case.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant::cases {

/// How fast an op runs at the size of its case's benchmark. Zero where a case does not say or there is
/// nothing to measure.
struct Timing {
  std::string what;             ///< "linear 196608x128x128 {}"
  double forward_seconds = 0;   ///< median
  double both_seconds = 0;      ///< forward and backward; 0 for ops without a gradient
  double flops = 0, bytes = 0;  ///< of the forward pass
  double both_flops = 0;        ///< of forward and backward, as the ops count them
  double gflops() const { return flops / forward_seconds * 1e-9; }
  double gigabytes_per_second() const { return bytes / forward_seconds * 1e-9; }
  double both_gflops() const { return both_seconds > 0 ? both_flops / both_seconds * 1e-9 : 0; }
};

/// Runs the benchmark of a case; `quick` takes fewer repetitions.
Timing measure(Device& device, const OpCase& op_case, bool quick);

}  // namespace vivant::cases
