#pragma once
#include <span>
#include <vector>

#include "vivant/graph/executor.hpp"

namespace vivant {

/// The device of all tests of one program: programs are compiled once.
inline Device& test_device() {
  static Device device;
  return device;
}

/// How far numbers may differ, by the arithmetic of matrix products (`VIVANT_MATH`): a limit for fp32, which
/// bf16x3 meets too unless it asks for more than a few of its products in a row keep, and one for bf16's 8
/// bits.
inline double tolerance(double fp32, double bf16 = 1e-2) {
  constexpr double bf16x3_least = 5e-5;  // a product's relative rms error is 1e-5 at most
  switch (test_device().math()) {
    case Math::bf16:
      return bf16;
    case Math::bf16x3:
      return std::max(fp32, bf16x3_least);
    default:
      return fp32;
  }
}

/// Runs a graph for a few outputs.
class Run {
 public:
  Run(Graph& graph, const Values& outputs, ExecutorOptions options = {})
      : executor_(test_device(), graph, outputs, options) {}
  void write(Value input, const std::vector<float>& data) {
    executor_.write(input, std::span<const float>(data));
  }
  /// Runs the graph with what was written, and reads an output.
  std::vector<float> read(Value output) {
    executor_.run();
    return executor_.read(output);
  }
  Executor& executor() { return executor_; }

 private:
  Executor executor_;
};

}  // namespace vivant
