#include "vivant/jobs/train.hpp"
#include "app/commands.hpp"

namespace vivant::app {
namespace {

struct Arguments {
  TrainOptions train;
  std::string preset, stage = "all";
  std::filesystem::path config_file;
  std::vector<std::string> settings;
};

void run(const Globals& globals, Arguments& arguments) {
  TrainOptions& options = arguments.train;
  if (options.resume) {
    if (!options.capture.empty() || !arguments.preset.empty() || !arguments.config_file.empty() ||
        !arguments.settings.empty() || !options.styles.empty())
      throw UsageError(
          "--resume goes on with the run's own capture, settings and styles: leave CAPTURE, --preset, "
          "--config, --set and --styles out");
    if (options.print_plan || !options.dot.empty())
      throw UsageError(
          "--print-plan and --dot draw what a new run would train: give a CAPTURE, not --resume");
  } else {
    if (options.capture.empty()) throw UsageError("train needs a CAPTURE, or --resume to go on with a run");
    options.config = load_config(
        arguments.preset, arguments.config_file.empty() ? std::nullopt : std::optional(arguments.config_file),
        arguments.settings);
  }
  options.stage = arguments.stage;
  Device device(globals.device);
  Progress progress(globals.progress, globals.verbose);
  train(device, options, progress);
  print_profile(device, globals);
}

}  // namespace

void add_train(CLI::App& app, const Globals& globals) {
  CLI::App* command =
      app.add_subcommand("train", "Train a capture's model: scene, person, features and stylisation");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("CAPTURE", arguments->train.capture,
                      "folder with a transforms.json, or the file itself");
  command
      ->add_option("--run", arguments->train.run,
                   "folder of the run: a new one, or with --resume the one to go on with")
      ->required();
  command->add_option("--preset", arguments->preset, "demo, standard or quality: how long and how fine")
      ->type_name("NAME");
  command->add_option("--config", arguments->config_file, "TOML file with settings")->type_name("FILE");
  command->add_option("--set", arguments->settings, "one setting, such as scene.steps=500; may be repeated")
      ->allow_extra_args(false)
      ->type_name("KEY=VALUE");
  command->add_option("--stage", arguments->stage, "which part to train")
      ->check(CLI::IsMember({"reconstruct", "features", "style", "all"}));
  command
      ->add_option("--styles", arguments->train.styles,
                   "folder of paintings to tune the stylisation on; else those of the program")
      ->type_name("DIR");
  command->add_flag("--resume", arguments->train.resume, "go on from the newest checkpoint, bit for bit");
  command->add_flag("--print-plan", arguments->train.print_plan,
                    "print the first training graph (ops, shapes, bytes, FLOPs) and stop");
  command->add_option("--dot", arguments->train.dot, "write a drawing of the first training graph and stop")
      ->type_name("FILE");
  command->footer(
      "Examples:\n"
      "  vivant train my-capture --run runs/first --preset demo\n"
      "  vivant train my-capture --run runs/second --set scene.plane_size=256 --set training.seed=7\n"
      "  vivant train --resume --run runs/first");
  command->callback([&globals, arguments] { run(globals, *arguments); });
}

}  // namespace vivant::app
