#include "vivant/jobs/pretrain_stylizer.hpp"
#include "app/commands.hpp"

namespace vivant::app {
namespace {

void run(const PretrainStylizerOptions& options, const Globals& globals) {
  Device device(globals.device);
  Progress progress(globals.progress, globals.verbose);
  pretrain_stylizer(device, options, progress);
  progress.info(fmt::format("{} holds the stylizer; {} shows what it does", options.output.string(),
                            (options.run / "previews").string()));
  print_profile(device, globals);
}

}  // namespace

void add_pretrain_stylizer(CLI::App& app, const Globals& globals) {
  CLI::App* command =
      app.add_subcommand("pretrain-stylizer", "Train the stylizer that every capture starts from");
  command->footer(
      "Needs photographs and paintings; scripts/pretrain-stylizer collects free ones and runs this.\n"
      "Examples:\n"
      "  vivant pretrain-stylizer --photographs photos --paintings paintings --run out/stylizer -o "
      "stylizer.safetensors\n"
      "  vivant pretrain-stylizer --photographs photos --paintings paintings --run out/stylizer -o "
      "stylizer.safetensors --resume");
  const auto options = std::make_shared<PretrainStylizerOptions>();
  command->add_option("--photographs", options->photographs, "folders of photographs")
      ->required()
      ->type_name("DIR");
  command->add_option("--paintings", options->paintings, "folders of paintings")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--unseen", options->unseen,
                   "paintings whose file name starts so are not trained on, but tried in the previews")
      ->capture_default_str();
  command->add_option("--run", options->run, "folder for checkpoints, previews and metrics")
      ->required()
      ->type_name("DIR");
  command->add_option("-o,--output", options->output, "the stylizer")
      ->required()
      ->type_name("FILE.safetensors");
  command
      ->add_option("--form", options->form,
                   "guided: what renders use; plain: AdaAttN on relu3_1 with its mirrored VGG decoder; "
                   "cosine: the same "
                   "with the scores of its video variant. The latter two are baselines for `vivant stylise`")
      ->check(CLI::IsMember({"guided", "plain", "cosine"}))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "of all random numbers")->capture_default_str();
  command->add_option("--inversion-steps", options->inversion_steps, "steps that learn to decode features")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--style-steps", options->style_steps, "steps with the style losses")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      ->add_option(
          "--global-weight", options->global_weight,
          "of the global style loss, a channel's mean and deviation: the less, the steadier films are, "
          "and the farther from the painting")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--resume", options->resume, "go on with the run");
  command->callback([options, &globals] { run(*options, globals); });
}

}  // namespace vivant::app
