#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/ops/limits.hpp"
#include "cases/op_case.hpp"

namespace vivant::bench {

/// What a pass of an op took, and what it had to do. All zero when there is no such pass.
struct Pass {
  double seconds = 0;
  double flops = 0;  ///< 0 for ops that only move data, and where nobody counts them
  double bytes = 0;  ///< that must move at least: every tensor once
  double launches = 0, allocations = 0;

  explicit operator bool() const { return seconds > 0; }
  double gflops() const { return seconds > 0 ? flops / seconds * 1e-9 : 0; }
  double gigabytes_per_second() const { return seconds > 0 ? bytes / seconds * 1e-9 : 0; }
  double intensity() const { return flops / bytes; }
  /// Of what the roofline allows at this arithmetic intensity.
  double percent_of_peak(const Limits& limits) const {
    return seconds > 0 ? 100 * limits.least_seconds(flops, bytes) / seconds : 0;
  }
};

/// An op at the size of its case's benchmark.
struct OpTiming {
  const cases::OpCase* op_case = nullptr;
  Pass forward;
  Pass both;  ///< forward and backward in one graph; zero for ops without a gradient
};

/// The cases that have a benchmark and `filter` in the name of the op or of the case's file. Throws
/// UsageError when there is none.
std::vector<const cases::OpCase*> cases_named(const std::string& filter);

OpTiming measure_op(Device& device, const cases::OpCase& op_case, bool quick);

/// The timing as one JSON object.
nlohmann::json to_json(const OpTiming& timing, const Limits& limits, const Device& device);

}  // namespace vivant::bench
