#include "vivant/jobs/reproduce.hpp"

#include "app/commands.hpp"
#include "vivant/io/atomic_file.hpp"

namespace vivant::app {
namespace {

struct Arguments {
  ReproduceOptions options;
  std::string preset;
  std::vector<std::string> settings;
  std::filesystem::path json;
};

void run(Arguments& arguments, const Globals& globals) {
  arguments.options.config = load_config(arguments.preset, std::nullopt, arguments.settings);
  Device device(globals.device);
  Progress progress(globals.progress, globals.verbose);
  const Reproduction made = reproduce(device, arguments.options, progress);
  if (!arguments.json.empty()) write_text_file(arguments.json, made.json().dump(1) + "\n");
  fmt::print("{}", made.report.text());
  progress.info(fmt::format("wrote {}", (made.folder / "report.html").string()));
  print_profile(device, globals);
}

}  // namespace

void add_reproduce(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand("reproduce", "The paper's tables on captures, in one report");
  command->footer(
      "Examples:\n"
      "  vivant reproduce walk --preset demo\n"
      "  vivant reproduce walk --style wave.jpg --style clipper.jpg --motion dance.bvh -o walk-report\n"
      "  vivant reproduce walk run tennis --style wave.jpg -o three-captures\n"
      "\n"
      "Trains each capture twice (geometry-guided and vanilla planes), renders and paints original views, "
      "novel views "
      "and\nnovel poses, and measures them: hours with the standard preset. After Ctrl-C the same command "
      "goes on.");
  const auto arguments = std::make_shared<Arguments>();
  ReproduceOptions& options = arguments->options;
  command
      ->add_option("CAPTURE", options.captures,
                   "folder with a transforms.json; of several all tables are made, and their means")
      ->required();
  command->add_option("--preset", arguments->preset, "demo, standard or quality: how long and how fine")
      ->type_name("NAME");
  command->add_option("--set", arguments->settings, "one setting of both trainings; may be repeated")
      ->allow_extra_args(false)
      ->type_name("KEY=VALUE");
  command
      ->add_option("--style", options.styles,
                   "a painting, may be repeated; else those that come with the program")
      ->allow_extra_args(false)
      ->type_name("IMAGE");
  command
      ->add_option(
          "--motion", options.motion,
          "the novel poses: .safetensors poses, .bvh or AMASS .npz; else the capture's dance.safetensors")
      ->type_name("FILE");
  command
      ->add_option("-o,--output", options.output,
                   "folder of runs, films and report; else NAME-report, of several captures reproduction")
      ->type_name("DIR");
  command->add_option("--json", arguments->json, "write every figure into this file, too")->type_name("FILE");
  command->callback([arguments, &globals] { run(*arguments, globals); });
}

}  // namespace vivant::app
