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

/// The device of a command; prints the kernels' times at the end when --profile asks for them.
class CommandDevice : public Device {
 public:
  explicit CommandDevice(const Globals& globals)
      : Device(globals.device), profiled_(globals.device.profile) {}
  CommandDevice(const CommandDevice&) = delete;
  CommandDevice& operator=(const CommandDevice&) = delete;
  ~CommandDevice() {
    if (profiled_) fmt::print(stderr, "{}", profiler().table());
  }

 private:
  bool profiled_;
};

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
