#include "vivant/jobs/render.hpp"

#include "app/commands.hpp"
#include "app/film_options.hpp"

namespace vivant::app {
void add_render(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand("render", "Render views of a run");
  command->footer(
      "Examples:\n"
      "  vivant render runs/first --views test -o held-out\n"
      "  vivant render runs/first --views orbit --orbit-angle 20 -o orbit.mp4\n"
      "  vivant render runs/first --motion dance.bvh -o dance.mp4\n"
      "  vivant render runs/first --views all --style painting.jpg -o painted.mp4\n"
      "  vivant render runs/first --style wave.jpg:0.7 --style clipper.jpg:0.3 -o mixed.mp4\n"
      "  vivant render runs/first --person-style wave.jpg --scene-style clipper.jpg -o layers.mp4\n"
      "  vivant render runs/first --style wave.jpg --scene-style none -o person-painted.mp4\n"
      "  vivant render runs/first --scene runs/garden --place 0.5,0,-1,90 -o in-the-garden.mp4\n"
      "  vivant render runs/first --views path.json --size 960x540 --frames 0:24 -o path.mp4");
  const auto options = std::make_shared<RenderOptions>();
  command->add_option("RUN", options->run, "folder of a trained run")->required();
  CLI::Option* views = add_film(*command, options->film, options->scene);
  command->add_option("--layers", options->layers, "what is shown")
      ->check(CLI::IsMember({"both", "scene", "human"}))
      ->capture_default_str();
  const auto styles = std::make_shared<StyleTexts>();
  add_look(*command, options->look, *styles);
  command->add_option("-o,--output", options->output, "a film (.mp4) or a folder for pictures")
      ->required()
      ->type_name("FILE|DIR");
  command->callback([options, styles, views, command, &globals] {
    styles->apply(options->look);
    refuse_unused(*command, options->film, options->look);
    if ((!options->film.motion.empty() || !options->scene.empty()) && views->count() == 0)
      options->film.views = "first";
    Device device(globals.device);
    Progress progress(globals.progress, globals.verbose);
    render(device, *options, progress);
    progress.info(fmt::format("wrote {}", options->output.string()));
    print_profile(device, globals);
  });
}

}  // namespace vivant::app
