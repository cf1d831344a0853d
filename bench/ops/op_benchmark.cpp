#include "bench/ops/op_benchmark.hpp"

#include "bench/ops/measure.hpp"
#include "cases/case_runner.hpp"

namespace vivant::bench {
namespace {

using cases::CaseRun;
using cases::OpCase;

Pass measure_pass(Device& device, CaseRun& run, const std::string& name, bool quick) {
  const Cost cost = measure(
      device, name, [&] { run.run(); }, quick);
  return {.seconds = cost.seconds, .launches = cost.launches, .allocations = cost.allocations};
}

void add_pass(nlohmann::json& row, const std::string& name, const Pass& pass, const Limits& limits) {
  row[name + "_seconds"] = pass.seconds;
  row[name + "_gflops"] = pass.gflops();
  row[name + "_gigabytes_per_second"] = pass.gigabytes_per_second();
  row[name + "_percent_of_peak"] = pass.percent_of_peak(limits);
  row[name + "_launches"] = pass.launches;
  row[name + "_allocations"] = pass.allocations;
}

}  // namespace

std::vector<const OpCase*> cases_named(const std::string& filter) {
  std::vector<const OpCase*> chosen;
  for (const OpCase& op_case : cases::all_cases()) {
    const bool named =
        op_case.op.find(filter) != std::string::npos || op_case.file.find(filter) != std::string::npos;
    if (named && !op_case.benchmark.sizes.empty()) chosen.push_back(&op_case);
  }
  if (chosen.empty())
    throw UsageError(
        fmt::format("no op with a benchmark has '{}' in its name: `vivant op list` names them", filter));
  return chosen;
}

OpTiming measure_op(Device& device, const OpCase& op_case, bool quick) {
  const std::string name = describe(op_case, op_case.benchmark);
  OpTiming timing{.op_case = &op_case, .forward = {}, .both = {}};
  bool differentiable = false;
  double graph_flops = 0;
  {
    CaseRun run(device, op_case, op_case.benchmark, false);
    timing.forward = measure_pass(device, run, name + "/forward", quick);
    graph_flops = run.executor().flops();
    timing.forward.flops = op_case.flops ? op_case.flops(op_case.benchmark) : graph_flops;
    timing.forward.bytes = op_case.bytes ? op_case.bytes(op_case.benchmark) : 0;
    for (const cases::HostTensor& input : run.inputs())
      differentiable |= !input.absent && input.differentiable && input.dtype == DType::real;
  }
  if (differentiable) {
    CaseRun run(device, op_case, op_case.benchmark, true);
    timing.both = measure_pass(device, run, name + "/forward+backward", quick);
    timing.both.flops = timing.forward.flops + run.executor().flops() - graph_flops;
    timing.both.bytes = timing.forward.bytes + run.gradient_bytes();
  }
  return timing;
}

nlohmann::json to_json(const OpTiming& timing, const Limits& limits, const Device& device) {
  nlohmann::json row = {
      {"op", timing.op_case->op},
      {"sizes", timing.op_case->benchmark.sizes},
      {"attributes", timing.op_case->benchmark.attributes},
      {"device", device.info().name},
      {"device_class", device.device_class() == DeviceClass::gpu ? "gpu" : "cpu"},
  };
  add_pass(row, "forward", timing.forward, limits);
  add_pass(row, "forward_and_backward", timing.both, limits);
  return row;
}

}  // namespace vivant::bench
