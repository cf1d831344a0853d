#pragma once
#include <CLI/CLI.hpp>

#include "vivant/jobs/progress.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant::app {

/// What every subcommand understands. Filled before a subcommand's callback runs.
struct Globals {
  DeviceOptions device;
  ProgressMode progress = ProgressMode::automatic;
  bool verbose = false;
};

/// Prints the kernels' times when --profile asks for them. At the end of a command that went well.
inline void print_profile(Device& device, const Globals& globals) {
  if (globals.device.profile) fmt::print(stderr, "{}", device.profiler().table());
}

// Each adds one subcommand to `app`, in the file of its name.
void add_synth(CLI::App& app, const Globals& globals);
void add_pretrain_stylizer(CLI::App& app, const Globals& globals);
void add_devices(CLI::App& app, const Globals& globals);
void add_op(CLI::App& app, const Globals& globals);
void add_bench(CLI::App& app, const Globals& globals);
void add_tune(CLI::App& app, const Globals& globals);
void add_train(CLI::App& app, const Globals& globals);
void add_render(CLI::App& app, const Globals& globals);
void add_batch(CLI::App& app, const Globals& globals);
void add_eval(CLI::App& app, const Globals& globals);
void add_reproduce(CLI::App& app, const Globals& globals);
void add_stylise(CLI::App& app, const Globals& globals);

}  // namespace vivant::app
