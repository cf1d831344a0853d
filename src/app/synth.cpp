#include "vivant/jobs/synth.hpp"
#include "app/commands.hpp"
#include "vivant/jobs/values.hpp"

namespace vivant::app {
namespace {

void run(const SynthOptions& options, const Globals& globals) {
  Progress progress(globals.progress, globals.verbose);
  bool begun = false;
  synthesise(options, [&](int done, int total) {
    if (!begun) progress.begin("synth", 0, total);
    begun = true;
    progress.report({.step = done});
  });
  progress.end();
  progress.info(fmt::format("{} holds a capture of {} frames, and {} novel views and poses to compare with",
                            options.output.string(), options.frames, (options.output / "truth").string()));
}

}  // namespace

void add_synth(CLI::App& app, const Globals& globals) {
  CLI::App* command =
      app.add_subcommand("synth", "Make a capture whose truth is known: a walk through a room");
  command->footer(
      "Examples:\n"
      "  vivant synth -o walk\n"
      "  vivant synth -o dance --frames 60 --size 480x270 --seed 3 --motion dance.bvh");
  const auto options = std::make_shared<SynthOptions>();
  command->add_option("-o,--output", options->output, "a new or empty folder")->required()->type_name("DIR");
  command->add_option("--frames", options->frames, "number of frames")->capture_default_str();
  command
      ->add_option_function<std::string>(
          "--size",
          [options](const std::string& text) { std::tie(options->width, options->height) = size_from(text); },
          "size of the pictures")
      ->default_str("320x240")
      ->type_name("WxH");
  command->add_option("--seed", options->seed, "changes colours, textures and the walk")
      ->capture_default_str();
  command
      ->add_option("--motion", options->motion, "poses (safetensors), BVH or AMASS; else a procedural walk")
      ->type_name("FILE");
  command->callback([options, &globals] { run(*options, globals); });
}

}  // namespace vivant::app
