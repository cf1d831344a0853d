#include "app/commands.hpp"

namespace vivant::app {
namespace {

void print_devices(const DeviceOptions& options) {
  const Device chosen(options);  // says which packages to install when there is no device
  fmt::print("{:<3} {:<4} {:<44} {:>6} {:>10} {:>12}  {}\n", "#", "kind", "name", "units", "memory", "buffer",
             "platform");
  for (const DeviceInfo& info : list_devices())
    fmt::print("{:<3} {:<4} {:<44} {:>6} {:>6} MiB {:>8} MiB  {}, {}{}\n", info.index,
               info.is_gpu ? "GPU" : "CPU", info.name, info.compute_units, info.memory_bytes >> 20,
               info.largest_buffer_bytes >> 20, info.platform, info.driver,
               info.index == chosen.info().index ? "  <- used" : "");
  fmt::print("arithmetic: {} (matrix units: {})\n", name_of(chosen.math()), name_of(chosen.matrix_units()));
}

}  // namespace

void add_devices(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand("devices", "List the OpenCL devices and the one that is used");
  command->footer(
      "Examples:\n"
      "  vivant devices\n"
      "  vivant devices --device 1        which device does this name?");
  command->callback([&globals] { print_devices(globals.device); });
}

}  // namespace vivant::app
