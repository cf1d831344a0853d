#include "app/commands.hpp"
#include "app/film_options.hpp"
#include "vivant/jobs/evaluate.hpp"
#include "vivant/jobs/evaluate_film.hpp"
#include "vivant/jobs/evaluate_motion.hpp"

namespace vivant::app {
namespace {

struct Arguments {
  FilmEvaluationOptions film;
  StyleTexts styles;
  EvaluationOptions pictures;
  bool average_films = false, json = false;
};

void print(const Report& report, const nlohmann::ordered_json& data, bool json) {
  fmt::print("{}", json ? data.dump(1) + "\n" : report.text());
}

/// What one says of a film, or of its style, means nothing when there is none.
void refuse_unused(const CLI::App& command, const Arguments& arguments) {
  const bool stylised = arguments.film.look.stylised(), moved = !arguments.film.film.motion.empty();
  if (!stylised) refuse_options(command, {"--flow"}, "is of a stylised film: give --style");
  if (stylised || moved || !arguments.pictures.truth.empty())
    refuse_options(command, {"--fit-poses"},
                   "is of the run's own held-out frames: leave --style, --motion and --truth out");
  if (!stylised && !moved)
    refuse_options(command,
                   {"--views", "--orbit-angle", "--orbit-frames", "--size", "--frames", "--scene", "--place"},
                   arguments.pictures.truth.empty() ? "is of a film: give --motion or --style"
                                                    : "is of a film, which --truth is not: leave it out");
  app::refuse_unused(command, arguments.film.film, arguments.film.look);
}

void run(Arguments& arguments, const Globals& globals) {
  FilmEvaluationOptions& film = arguments.film;
  if (!film.look.stylised() && !film.others.empty())
    throw UsageError("--film needs the style that the films are painted in: give --style");
  if (arguments.average_films && film.others.empty())
    throw UsageError("--average-films is of other methods' films: give --film");
  for (OtherFilm& other : film.others) other.averaged = arguments.average_films;
  if (film.look.stylised() && !arguments.pictures.truth.empty())
    throw UsageError("--truth compares unstylised pictures: leave --style out");
  if (!film.film.motion.empty() && !arguments.pictures.truth.empty())
    throw UsageError("--truth has poses of its own: leave --motion out");
  Device device(globals.device);
  Progress progress(globals.progress, globals.verbose);
  if (film.look.stylised()) {
    const FilmQuality quality = evaluate_film(device, film, progress);
    print(quality.report(), quality.json(), arguments.json);
  } else if (!film.film.motion.empty()) {
    const OpenRun run = open_run(device, film.run, progress);
    std::optional<OpenRun> scene;
    if (!film.scene.empty()) scene.emplace(open_run(device, film.scene, progress));
    const MotionEvaluation evaluation =
        evaluate_motion(device, run, scene ? *scene : run, film.film, film.output, progress);
    print(evaluation.report(), evaluation.json(), arguments.json);
  } else {
    const Evaluation evaluation =
        evaluate(device, open_run(device, film.run, progress), arguments.pictures, progress);
    if (!film.output.empty()) write_evaluation(film.output, evaluation);
    print(evaluation.report(), evaluation.json(), arguments.json);
  }
  print_profile(device, globals);
}

}  // namespace

void add_eval(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand(
      "eval", "Measure a run: its pictures against true ones, novel poses, or a stylised film");
  command->footer(
      "Examples:\n"
      "  vivant eval runs/first\n"
      "  vivant eval runs/walk --truth walk/truth/novel_poses -o report\n"
      "  vivant eval runs/first --json > scores.json\n"
      "  vivant eval runs/first --fit-poses 200\n"
      "  vivant eval runs/walk --motion dance.bvh -o report\n"
      "  vivant eval runs/first --style wave.jpg --views all -o report\n"
      "  vivant eval runs/first --style wave.jpg --views orbit --film other=frames/ -o report\n"
      "\n"
      "With --motion the rendered person is compared with the posed body; no true pictures are needed.\n"
      "\n"
      "With --style a film is rendered unstylised and in that style, and both are measured: temporal "
      "consistency "
      "at\ngaps of 1 and 7 frames, and by VGG-19 the distances to the painting and to the unstylised film.");
  const auto arguments = std::make_shared<Arguments>();
  FilmEvaluationOptions& film = arguments->film;
  film.film.views = "all";
  command->add_option("RUN", film.run, "folder of a trained run")->required();
  command
      ->add_option("--truth", arguments->pictures.truth,
                   "a capture of the same world and person, all frames; else the run's held-out frames")
      ->type_name("CAPTURE");
  command
      ->add_option(
          "--fit-poses", arguments->pictures.fit_pose_steps,
          "first fit the person's corrections to the held-out pictures themselves, in so many steps, "
          "the fields as they are: tells what part of the error is the poses' at most, and is no held-out "
          "figure")
      ->check(CLI::Range(1, 100000))
      ->type_name("STEPS");
  CLI::Option* views = add_film(*command, film.film, film.scene);
  add_look(*command, film.look, arguments->styles);
  command
      ->add_option_function<std::string>(
          "--flow",
          [&film](const std::string& name) {
            film.flow = name == "dis"        ? FlowKind::dis
                        : name == "geometry" ? FlowKind::geometry
                                             : FlowKind::automatic;
          },
          "where the optical flow comes from: the geometry of the rendered views, DIS on the capture's "
          "pictures (of other views: on the unstylised film), or the geometry unless the unstylised film "
          "changes 5 % less with DIS")
      ->check(CLI::IsMember({"auto", "geometry", "dis"}))
      ->default_str("auto");
  command
      ->add_option_function<std::vector<std::string>>(
          "--film",
          [&film](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) film.others.push_back(named_film_from(text));
          },
          "the same film by another method, to be measured beside: .mp4, or a folder of pictures")
      ->allow_extra_args(false)
      ->type_name("NAME=PATH");
  command->add_flag("--average-films", arguments->average_films,
                    "measure each --film a second time, as the mean over seven frames that our films are");
  command
      ->add_option("-o,--output", film.output, "folder for report.json, report.md, index.html and the films")
      ->type_name("DIR");
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments, views, command, &globals] {
    arguments->styles.apply(arguments->film.look);
    refuse_unused(*command, *arguments);
    FilmOptions& shown = arguments->film.film;
    if ((!shown.motion.empty() || !arguments->film.scene.empty()) && views->count() == 0)
      shown.views = "first";
    run(*arguments, globals);
  });
}

}  // namespace vivant::app
