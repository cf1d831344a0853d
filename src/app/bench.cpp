#include <filesystem>

#include "app/commands.hpp"
#include "bench/ops/op_benchmark.hpp"
#include "bench/ops/roofline_svg.hpp"
#include "cases/case_runner.hpp"
#include "vivant/io/atomic_file.hpp"

namespace vivant::app {
namespace {

struct BenchOptions {
  std::string filter;
  bool json = false, quick = false;
};

struct RooflineOptions {
  std::string filter;
  std::filesystem::path output = "roofline.svg", json;
  bool quick = false;
};

std::string number_or_dash(double number) { return number > 0 ? fmt::format("{:.1f}", number) : "-"; }

void print_header(const bench::Limits& limits) {
  fmt::print("{}\n\n", describe(limits));
  fmt::print("{:<52} {:<10} {:>10} {:>8} {:>7} {:>7} {:>8} {:>11}\n", "op sizes attributes", "pass", "ms",
             "GF/s", "GB/s", "% peak", "launches", "allocations");
}

void print_pass(const std::string& what, const std::string& name, const bench::Pass& pass,
                const bench::Limits& limits) {
  fmt::print("{:<52} {:<10} {:>10.3f} {:>8} {:>7} {:>7} {:>8.0f} {:>11.0f}\n", what, name, pass.seconds * 1e3,
             number_or_dash(pass.gflops()), number_or_dash(pass.gigabytes_per_second()),
             number_or_dash(pass.percent_of_peak(limits)), pass.launches, pass.allocations);
}

void print_rows(const bench::OpTiming& timing, const bench::Limits& limits) {
  const cases::OpCase& op_case = *timing.op_case;
  print_pass(describe(op_case, op_case.benchmark), "forward", timing.forward, limits);
  if (timing.both) print_pass("", "+ backward", timing.both, limits);
}

void run(const BenchOptions& options, const DeviceOptions& device_options) {
  const std::vector<const cases::OpCase*> chosen = bench::cases_named(options.filter);
  Device device(device_options);
  const bench::Limits limits = bench::measure_limits(device, options.quick);
  if (!options.json) print_header(limits);
  for (const cases::OpCase* op_case : chosen) {
    const bench::OpTiming timing = bench::measure_op(device, *op_case, options.quick);
    if (options.json)
      fmt::print("{}\n", to_json(timing, limits, device).dump());
    else
      print_rows(timing, limits);
    std::fflush(stdout);
  }
}

void run_roofline(const RooflineOptions& options, const DeviceOptions& device_options) {
  const std::vector<const cases::OpCase*> chosen = bench::cases_named(options.filter);
  // Before the minutes of measuring, so that a folder that cannot be written shows at once.
  AtomicFile picture(options.output);
  std::optional<AtomicFile> json;
  if (!options.json.empty()) json.emplace(options.json);
  Device device(device_options);
  const bench::Limits limits = bench::measure_limits(device, options.quick);
  print_header(limits);
  std::vector<bench::OpTiming> timings;
  nlohmann::json rows = nlohmann::json::array();
  for (const cases::OpCase* op_case : chosen) {
    timings.push_back(bench::measure_op(device, *op_case, options.quick));
    print_rows(timings.back(), limits);
    std::fflush(stdout);
    rows.push_back(to_json(timings.back(), limits, device));
  }
  picture.write(bench::roofline_svg(timings, limits, device.info().name));
  picture.commit();
  if (json) {
    json->write(nlohmann::json{{"limits", to_json(limits)}, {"rows", rows}}.dump(1) + "\n");
    json->commit();
  }
}

void add_roofline(CLI::App& bench, const Globals& globals) {
  CLI::App* command = bench.add_subcommand(
      "roofline", "Measure the device's limits and draw every op below them, as an SVG picture");
  command->footer(
      "Examples:\n"
      "  vivant bench roofline\n"
      "  vivant bench roofline conv2d --quick -o conv2d.svg --json conv2d.json");
  const auto options = std::make_shared<RooflineOptions>();
  command->add_option("filter", options->filter,
                      "only ops with this in the name of the op or of its case file");
  command->add_option("-o,--output", options->output, "the picture")->capture_default_str();
  command->add_option("--json", options->json, "also write limits and rows to this file")->type_name("FILE");
  command->add_flag("--quick", options->quick, "smaller arrays, fewer and shorter repetitions");
  command->callback([options, &globals] { run_roofline(*options, globals.device); });
}

}  // namespace

void add_bench(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand("bench", "Measure every op at a size that is met in practice");
  command->footer(
      "Times are medians of wall time, the wait for the device included. \"+ backward\" is forward and "
      "backward\n"
      "together. GB/s counts every tensor once. \"% peak\" is the share of what this device allows at the "
      "op's\n"
      "arithmetic intensity: the smaller of the measured FMA rate, and intensity x the measured memory\n"
      "bandwidth; data that stays in the caches can exceed it. Launches are kernels in one run, allocations\n"
      "buffers that a run makes.\n"
      "Examples:\n"
      "  vivant bench\n"
      "  vivant bench conv2d --quick\n"
      "  vivant bench --json > rows.jsonl\n"
      "  vivant bench roofline -o roofline.svg");
  const auto options = std::make_shared<BenchOptions>();
  command->add_option("filter", options->filter,
                      "only ops with this in the name of the op or of its case file");
  command->add_flag("--json", options->json, "one JSON object per line");
  command->add_flag("--quick", options->quick, "smaller arrays, fewer and shorter repetitions");
  add_roofline(*command, globals);
  command->callback([options, command, &globals] {
    if (command->get_subcommands().empty()) run(*options, globals.device);
  });
}

}  // namespace vivant::app
