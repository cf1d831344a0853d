#include "vivant/jobs/render.hpp"

#include "app/commands.hpp"
#include "vivant/jobs/values.hpp"

namespace vivant::app {
namespace {

/// The styles as they are written on the command line.
struct StyleTexts {
  std::vector<std::string> both, person, scene;

  void apply(Look& look) const {
    if (!both.empty()) look.person = look.scene = mixture_from(both);
    if (!person.empty()) look.person = mixture_from(person);
    if (!scene.empty()) look.scene = mixture_from(scene);
  }
};

void add_look(CLI::App& command, Look& look, StyleTexts& styles) {
  const auto add = [&](const char* name, std::vector<std::string>& target, const char* help) {
    command.add_option(name, target, help)->allow_extra_args(false)->type_name("IMAGE[:WEIGHT]");
  };
  add("--style", styles.both, "paint in the style of this picture; given again: in a mixture by the weights");
  add("--person-style", styles.person, "another style, or mixture, for the person; none: as it is");
  add("--scene-style", styles.scene, "the same for the scene");
  command.add_option("--strength", look.strength, "of the style: 0 is the reconstruction, 1 the whole style")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_flag("--keep-colour", look.keep_colour,
                   "the painting's light and strokes in the colours of the reconstruction");
}

}  // namespace

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
  CLI::Option* views =
      command
          ->add_option("--views", options->film.views,
                       "all, train, test, first, orbit or a camera path as JSON; with --motion "
                       "or --scene first is the default")
          ->capture_default_str()
          ->type_name("VIEWS");
  command
      ->add_option("--orbit-angle", options->film.orbit_angle,
                   "degrees to each side of the middle frame's camera")
      ->capture_default_str();
  command->add_option("--orbit-frames", options->film.orbit_frames, "views of an orbit")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command
      ->add_option_function<std::string>(
          "--size", [options](const std::string& text) { options->film.size = size_from(text); },
          "size of the pictures; else the cameras' own")
      ->type_name("WxH");
  command
      ->add_option_function<std::string>(
          "--frames", [options](const std::string& text) { options->film.frames = frame_range_from(text); },
          "only these views, the end left out")
      ->type_name("FIRST:END");
  command
      ->add_option("--motion", options->film.motion,
                   "animates the person: .safetensors poses, .bvh or AMASS .npz")
      ->type_name("FILE");
  command
      ->add_option("--motion-names", options->film.mapping, "JSON object {body joint: joint of the BVH file}")
      ->type_name("FILE");
  command
      ->add_option(
          "--scene", options->scene,
          "another run: the person performs in its scene, seen by its cameras (the first one by default)")
      ->type_name("RUN2");
  command
      ->add_option_function<std::string>(
          "--place", [options](const std::string& text) { options->film.place = place_from(text); },
          "where the person stands: the ground below the first frame's root, and the degrees about the up "
          "axis (y "
          "up: 0 faces +z, 90 faces +x); a scene without metres of its own also needs its units in a metre")
      ->type_name("X,Y,Z,YAW[,UNITS]");
  command->add_option("--layers", options->layers, "what is shown")
      ->check(CLI::IsMember({"both", "scene", "human"}))
      ->capture_default_str();
  const auto styles = std::make_shared<StyleTexts>();
  add_look(*command, options->look, *styles);
  command->add_option("-o,--output", options->output, "a film (.mp4) or a folder for pictures")
      ->required()
      ->type_name("FILE|DIR");
  command->callback([options, styles, views, &globals] {
    styles->apply(options->look);
    if ((!options->film.motion.empty() || !options->scene.empty()) && views->count() == 0)
      options->film.views = "first";
    Device device(globals.device);
    Progress progress(globals.progress, globals.verbose);
    render(device, *options, progress);
    progress.info(fmt::format("wrote {}", options->output.string()));
  });
}

}  // namespace vivant::app
