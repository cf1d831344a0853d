#include "app/commands.hpp"
#include "vivant/jobs/evaluate.hpp"

namespace vivant::app {

void add_eval(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand("eval", "Compare pictures of a run with the true ones");
  command->footer(
      "Examples:\n  vivant eval runs/first\n  vivant eval runs/walk --truth walk/truth/novel_poses\n  vivant "
      "eval runs/first --json > scores.json");
  struct Arguments {
    std::filesystem::path run, truth;
    bool json = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("RUN", arguments->run, "folder of a trained run")->required();
  command
      ->add_option("--truth", arguments->truth,
                   "a capture of the same world and person, all frames; else the run's held-out frames")
      ->type_name("CAPTURE");
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments, &globals] {
    Device device(globals.device);
    Progress progress(globals.progress, globals.verbose);
    const Evaluation evaluation =
        evaluate(device, open_run(device, arguments->run, progress), arguments->truth, progress);
    fmt::print("{}", arguments->json ? evaluation.json().dump(1) + "\n" : evaluation.table());
  });
}

}  // namespace vivant::app
