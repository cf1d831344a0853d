#include "bench/ops/measure.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>

namespace vivant::bench {
namespace {

using benchmark::BenchmarkReporter;

/// Keeps the figures of the one benchmark that runs, and prints nothing.
class Collector : public BenchmarkReporter {
 public:
  bool ReportContext(const Context& /*context*/) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      const double seconds = run.GetAdjustedRealTime();
      if (run.run_type == Run::RT_Aggregate) {
        if (run.aggregate_name == "median") cost.seconds = seconds;
        continue;
      }
      if (cost.fastest_seconds == 0 || seconds < cost.fastest_seconds) cost.fastest_seconds = seconds;
      cost.launches = std::max<double>(cost.launches, run.counters.at("launches"));
      cost.allocations = std::max<double>(cost.allocations, run.counters.at("allocations"));
    }
  }
  Cost cost;
};

}  // namespace

Cost measure(Device& device, const std::string& name, const std::function<void()>& work, bool quick) {
  work();
  device.finish();
  const auto timed = [&](benchmark::State& state) {
    const std::int64_t launches = device.launches(), allocations = device.allocations();
    for ([[maybe_unused]] auto _ : state) {
      work();
      device.finish();
    }
    const auto per_run = [](std::int64_t count) {
      return benchmark::Counter(static_cast<double>(count), benchmark::Counter::kAvgIterations);
    };
    state.counters["launches"] = per_run(device.launches() - launches);
    state.counters["allocations"] = per_run(device.allocations() - allocations);
  };
  benchmark::ClearRegisteredBenchmarks();  // the one before, which may have failed
  benchmark::RegisterBenchmark(name.c_str(), timed)
      ->UseRealTime()
      ->Unit(benchmark::kSecond)
      ->MinTime(quick ? 0.01 : 0.1)
      ->Repetitions(quick ? 3 : 7);
  Collector collector;
  benchmark::RunSpecifiedBenchmarks(&collector, ".");
  return collector.cost;
}

}  // namespace vivant::bench
