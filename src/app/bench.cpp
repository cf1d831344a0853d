#include "app/commands.hpp"
#include "cases/benchmark.hpp"

namespace vivant::app {
namespace {

struct BenchOptions {
  std::string filter;
  bool json = false, quick = false;
};

std::string number_or_dash(double number) { return number > 0 ? fmt::format("{:.1f}", number) : "-"; }

void print_row(const cases::Timing& timing) {
  fmt::print("{:<52} {:>11.3f} {:>9} {:>9} {:>11} {:>9}\n", timing.what, timing.forward_seconds * 1e3,
             number_or_dash(timing.gflops()), number_or_dash(timing.gigabytes_per_second()),
             timing.both_seconds > 0 ? fmt::format("{:.3f}", timing.both_seconds * 1e3) : "-",
             number_or_dash(timing.both_gflops()));
}

void print_json(const cases::OpCase& op_case, const cases::Timing& timing, const Device& device) {
  const nlohmann::json row = {
      {"op", op_case.op},
      {"sizes", op_case.benchmark.sizes},
      {"attributes", op_case.benchmark.attributes},
      {"device", device.info().name},
      {"device_class", device.device_class() == DeviceClass::gpu ? "gpu" : "cpu"},
      {"forward_seconds", timing.forward_seconds},
      {"forward_gflops", timing.gflops()},
      {"forward_gigabytes_per_second", timing.gigabytes_per_second()},
      {"forward_and_backward_seconds", timing.both_seconds},
      {"forward_and_backward_gflops", timing.both_gflops()},
  };
  fmt::print("{}\n", row.dump());
}

void run(const BenchOptions& options, const DeviceOptions& device_options) {
  std::vector<const cases::OpCase*> chosen;
  for (const cases::OpCase& op_case : cases::all_cases())
    if (op_case.op.find(options.filter) != std::string::npos && !op_case.benchmark.sizes.empty())
      chosen.push_back(&op_case);
  if (chosen.empty())
    throw UsageError(fmt::format("no op with a benchmark has '{}' in its name: `vivant op list` names them",
                                 options.filter));
  Device device(device_options);
  if (!options.json)
    fmt::print("{:<52} {:>11} {:>9} {:>9} {:>11} {:>9}\n", "op sizes attributes", "forward ms", "GF/s",
               "GB/s", "+ back. ms", "GF/s");
  for (const cases::OpCase* op_case : chosen) {
    const cases::Timing timing = measure(device, *op_case, options.quick);
    options.json ? print_json(*op_case, timing, device) : print_row(timing);
    std::fflush(stdout);
  }
}

}  // namespace

void add_bench(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand("bench", "Measure every op at a size that is met in practice");
  command->footer(
      "Times are medians; the second pair is forward and backward together.\n"
      "Examples:\n"
      "  vivant bench\n"
      "  vivant bench conv2d --quick\n"
      "  vivant bench --json > rows.jsonl");
  const auto options = std::make_shared<BenchOptions>();
  command->add_option("filter", options->filter, "only ops with this in their name");
  command->add_flag("--json", options->json, "one JSON object per line");
  command->add_flag("--quick", options->quick, "fewer repetitions");
  command->callback([options, &globals] { run(*options, globals.device); });
}

}  // namespace vivant::app
