#include "vivant/jobs/batch.hpp"

#include <algorithm>

#include "app/commands.hpp"

namespace vivant::app {
namespace {

void run(const std::filesystem::path& file, const Globals& globals) {
  const std::vector<BatchJob> jobs = load_batch(file);
  Device device(globals.device);
  Progress progress(globals.progress, globals.verbose);
  const std::vector<BatchResult> results = run_batch(device, jobs, progress);
  fmt::print("{}", batch_table(results));
  print_profile(device, globals);
  const auto failed = std::count_if(results.begin(), results.end(),
                                    [](const BatchResult& result) { return !result.error.empty(); });
  if (failed > 0) fail("{} of {} films failed", failed, results.size());
}

}  // namespace

void add_batch(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand("batch", "Make many films: styles x motions x views");
  command->footer(
      "Example:\n"
      "  vivant batch jobs.toml\n"
      "\n"
      "jobs.toml has the options of `vivant render` as keys. Keys at the top hold for every [[job]]; lists "
      "of\n"
      "runs, views, motions and styles are multiplied:\n"
      "\n"
      "  output = \"films\"\n"
      "  size = \"480x270\"\n"
      "  style = [\"none\", \"starry.jpg\", \"wave.jpg\"]\n"
      "\n"
      "  [[job]]\n"
      "  run = \"runs/walk\"\n"
      "  views = [\"all\", \"orbit\"]\n"
      "\n"
      "  [[job]]\n"
      "  run = \"runs/walk\"\n"
      "  motion = [\"dance.bvh\", \"jump.bvh\"]\n"
      "\n"
      "Finished frames are kept, so that the same command goes on after Ctrl-C. All keys: docs/batch.md.");
  const auto file = std::make_shared<std::filesystem::path>();
  command->add_option("JOBS", *file, "TOML file")->required()->type_name("FILE");
  command->callback([file, &globals] { run(*file, globals); });
}

}  // namespace vivant::app
