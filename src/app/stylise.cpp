#include "app/commands.hpp"
#include "vivant/jobs/stylise_pictures.hpp"

namespace vivant::app {

void add_stylise(CLI::App& app, const Globals& globals) {
  CLI::App* command =
      app.add_subcommand("stylise", "Paint pictures one by one, without a run: the 2D baseline");
  command->footer(
      "Examples:\n"
      "  vivant stylise report/unstylised --style wave.jpg -o frames\n"
      "  vivant stylise film.mp4 --style wave.jpg --form cosine -o frames");
  const auto options = std::make_shared<StylisePicturesOptions>();
  command->add_option("INPUT", options->input, "a film (.mp4) or a folder of pictures")->required();
  command->add_option("--style", options->style, "paint in the style of this picture")
      ->required()
      ->type_name("IMAGE");
  command
      ->add_option("--stylizer", options->stylizer,
                   "weights by `vivant pretrain-stylizer`; else those that come with the program, for guided "
                   "and cosine")
      ->type_name("FILE.safetensors");
  command
      ->add_option(
          "--form", options->form,
          "what the weights were trained as. guided: what renders use; plain: AdaAttN on relu3_1 with "
          "its mirrored VGG decoder; cosine: the same with the scores of its video variant")
      ->check(CLI::IsMember({"guided", "plain", "cosine"}))
      ->capture_default_str();
  command->add_option("-o,--output", options->output, "folder for the pictures")
      ->required()
      ->type_name("DIR");
  command->callback([options, &globals] {
    Device device(globals.device);
    Progress progress(globals.progress, globals.verbose);
    stylise_pictures(device, *options, progress);
    progress.info(fmt::format("wrote {}", options->output.string()));
    print_profile(device, globals);
  });
}

}  // namespace vivant::app
