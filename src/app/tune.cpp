#include "bench/ops/tune.hpp"
#include "app/commands.hpp"

namespace vivant::app {
namespace {

struct TuneOptions {
  std::string filter;
  bool quick = false, reset = false;
};

std::string text_of(const Tile& tile) {
  const std::string text = fmt::format("{}x{}", tile.rows, tile.vectors);
  return tile.groups == 1 ? text : fmt::format("{} {}", tile.groups, text);
}

void reset(const Device& device) {
  const std::string file = TileTable::file(device.identity(), device.device_class()).string();
  if (TileTable::remove(device.identity(), device.device_class()))
    fmt::print("{} is deleted: the default tiles are used again\n", file);
  else
    fmt::print("nothing is stored for this device\n");
}

void tune(Device& device, const TuneOptions& options, const Globals& globals) {
  const std::vector<bench::TuneTask> tasks = bench::tune_tasks(device, options.filter, options.quick);
  Progress progress(globals.progress, globals.verbose);
  progress.begin("tune", 0, static_cast<std::int64_t>(tasks.size()));
  std::vector<std::string> rows;
  TileTable table = device.tiles();  // for kernels that the filter leaves out
  std::int64_t done = 0;
  for (const bench::TuneTask& task : tasks) {
    const bench::Tuned tuned = bench::tune(device, task, options.quick);
    table.set(task.kernel, task.panel, tuned.chosen.tile);
    rows.push_back(fmt::format("{:<26} {:>7} {:>9} {:>10.3f} {:>9} {:>10.3f} {:>6.2f}", name_of(task.kernel),
                               task.panel, text_of(tuned.standard.tile), tuned.standard.seconds * 1e3,
                               text_of(tuned.chosen.tile), tuned.chosen.seconds * 1e3,
                               tuned.standard.seconds / tuned.chosen.seconds));
    progress.report({.step = ++done});
  }
  progress.end();
  fmt::print("{:<26} {:>7} {:>9} {:>10} {:>9} {:>10} {:>6}\n", "kernel", "columns", "default", "ms", "chosen",
             "ms", "gain");
  for (const std::string& row : rows) fmt::print("{}\n", row);
  table.store(device.identity(), device.device_class());
  fmt::print("stored in {}: later runs on this device and driver use it\n",
             TileTable::file(device.identity(), device.device_class()).string());
}

}  // namespace

void add_tune(CLI::App& app, const Globals& globals) {
  CLI::App* command =
      app.add_subcommand("tune", "Find the fastest register tiles of matrix kernels on this device");
  command->footer(
      "Measures every tile that a kernel can have and stores the fastest beside the compiled programs\n"
      "(VIVANT_CACHE, or ~/.cache/vivant), for this device and driver; a tile that is less than 3 % faster\n"
      "than the default one is not taken. Results do not depend on tiles, to the bit. A tile is rows x\n"
      "vectors; attention's work-items have several, one below the other.\n"
      "Let nothing else run meanwhile.\n"
      "Examples:\n"
      "  vivant tune\n"
      "  vivant tune --quick --device 1\n"
      "  vivant tune conv2d\n"
      "  vivant tune --reset              back to the default tiles");
  const auto options = std::make_shared<TuneOptions>();
  CLI::Option* filter =
      command->add_option("filter", options->filter, "only kernels with this in their name");
  CLI::Option* quick = command->add_flag("--quick", options->quick,
                                         "panels of 32 and 64 columns alone, and no second, longer look");
  command->add_flag("--reset", options->reset, "delete what is stored for this device, measure nothing")
      ->excludes(quick)
      ->excludes(filter);
  command->callback([options, &globals] {
    DeviceOptions in_fp32 = globals.device;  // the kernels that have tiles to choose
    in_fp32.math = "fp32";
    Device device(in_fp32);
    options->reset ? reset(device) : tune(device, *options, globals);
  });
}

}  // namespace vivant::app
