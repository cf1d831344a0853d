#include "app/film_options.hpp"

#include "vivant/jobs/values.hpp"

namespace vivant::app {

CLI::Option* add_film(CLI::App& command, FilmOptions& film, std::filesystem::path& scene) {
  CLI::Option* views =
      command
          .add_option("--views", film.views,
                      "all, train, test, first, orbit or a camera path as JSON; with --motion "
                      "or --scene first is the default")
          ->capture_default_str()
          ->type_name("VIEWS");
  command.add_option("--orbit-angle", film.orbit_angle, "degrees to each side of the middle frame's camera")
      ->capture_default_str();
  command.add_option("--orbit-frames", film.orbit_frames, "views of an orbit")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command
      .add_option_function<std::string>(
          "--size", [&film](const std::string& text) { film.size = size_from(text); },
          "size of the pictures; else the cameras' own")
      ->type_name("WxH");
  command
      .add_option_function<std::string>(
          "--frames", [&film](const std::string& text) { film.frames = frame_range_from(text); },
          "only these views, the end left out")
      ->type_name("FIRST:END");
  command.add_option("--motion", film.motion, "animates the person: .safetensors poses, .bvh or AMASS .npz")
      ->type_name("FILE");
  command.add_option("--motion-names", film.mapping, "JSON object {body joint: joint of the BVH file}")
      ->type_name("FILE");
  command
      .add_option(
          "--scene", scene,
          "another run: the person performs in its scene, seen by its cameras (the first one by default)")
      ->type_name("RUN2");
  command
      .add_option_function<std::string>(
          "--place", [&film](const std::string& text) { film.place = place_from(text); },
          "where the person stands: the ground below the first frame's root, and the degrees about the up "
          "axis (y "
          "up: 0 faces +z, 90 faces +x); a scene without metres of its own also needs its units in a metre")
      ->type_name("X,Y,Z,YAW[,UNITS]");
  return views;
}

void refuse_options(const CLI::App& command, std::initializer_list<const char*> names,
                    const std::string& why) {
  for (const char* name : names)
    if (command.count(name) > 0) throw UsageError(fmt::format("{} {}", name, why));
}

void refuse_unused(const CLI::App& command, const FilmOptions& film, const Look& look) {
  if (!look.stylised())
    refuse_options(command, {"--strength", "--brushwork", "--keep-colour"},
                   "is of a stylised film: give --style");
  if (film.motion.empty()) refuse_options(command, {"--motion-names"}, "is of a motion: give --motion");
  if (film.views != "orbit")
    refuse_options(command, {"--orbit-angle", "--orbit-frames"}, "is of an orbit: give --views orbit");
}

void StyleTexts::apply(Look& look) const {
  if (!both.empty()) look.person = look.scene = mixture_from(both);
  if (!person.empty()) look.person = mixture_from(person);
  if (!scene.empty()) look.scene = mixture_from(scene);
}

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
  command
      .add_option(
          "--brushwork", look.brushwork,
          "of the painting's strokes on the surfaces: 0 is none, 1 at most as strong as in the painting")
      ->check(CLI::Range(0.0, 2.0))
      ->capture_default_str();
  command.add_flag("--keep-colour", look.keep_colour,
                   "the painting's light and strokes in the colours of the reconstruction");
}

}  // namespace vivant::app
