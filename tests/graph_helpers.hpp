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

/// How far numbers may differ: `fp32` in the modes that are as exact, and another limit where matrix products
/// keep 8 bits (`VIVANT_MATH=bf16`).
inline double tolerance(double fp32, double bf16 = 1e-2) {
  return test_device().math() == Math::bf16 ? bf16 : fp32;
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
