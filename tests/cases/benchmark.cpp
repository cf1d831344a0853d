#include "cases/benchmark.hpp"

#include <algorithm>
#include <chrono>

#include "cases/case_runner.hpp"

namespace vivant::cases {
namespace {

using Clock = std::chrono::steady_clock;

double median_seconds(Device& device, CaseRun& run, bool quick) {
  const double budget = quick ? 0.05 : 0.5;
  const std::size_t least = quick ? 3 : 7;
  run.run();  // the first run touches the memory
  device.finish();
  std::vector<double> seconds;
  double total = 0;
  while (seconds.size() < least || (total < budget && seconds.size() < 1000)) {
    const Clock::time_point start = Clock::now();
    run.run();
    device.finish();
    seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count());
    total += seconds.back();
  }
  std::nth_element(seconds.begin(), seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2),
                   seconds.end());
  return seconds[seconds.size() / 2];
}

}  // namespace

Timing measure(Device& device, const OpCase& op_case, bool quick) {
  const Variation& variation = op_case.benchmark;
  Timing timing;
  timing.what = describe(op_case, variation);
  if (op_case.bytes) timing.bytes = op_case.bytes(variation);
  bool differentiable = false;
  {
    CaseRun forward(device, op_case, variation, false);
    timing.flops = op_case.flops ? op_case.flops(variation) : forward.executor().flops();
    timing.forward_seconds = median_seconds(device, forward, quick);
    for (const HostTensor& input : forward.inputs())
      differentiable |= !input.absent && input.differentiable && input.dtype == DType::real;
  }
  if (differentiable) {
    CaseRun both(device, op_case, variation, true);
    timing.both_flops = both.executor().flops();
    timing.both_seconds = median_seconds(device, both, quick);
  }
  return timing;
}

}  // namespace vivant::cases
