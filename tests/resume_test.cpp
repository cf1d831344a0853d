// Training that is interrupted in any way and resumed ends with the same bits as training that is not.
#include <chrono>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include "tiny_training.hpp"
#include "vivant/jobs/run_folder.hpp"

using namespace vivant;
using namespace std::chrono_literals;

namespace {

/// The arguments of a new run, and of one that goes on.
std::vector<std::string> fresh(const std::filesystem::path& run) {
  std::vector<std::string> arguments = {"train", tiny_capture().string(), "--run", run.string()};
  const std::vector<std::string> settings = tiny_settings(60, 7);
  arguments.insert(arguments.end(), settings.begin(), settings.end());
  return arguments;
}
std::vector<std::string> resumed(const std::filesystem::path& run) {
  return {"train", "--resume", "--run", run.string()};
}

/// The rows of a run's metrics: stage, step and loss.
std::vector<std::string> metrics(const std::filesystem::path& run) {
  std::vector<std::string> rows;
  if (!std::filesystem::exists(run / "metrics.jsonl")) return rows;
  std::istringstream text(read_whole_file(run / "metrics.jsonl"));
  for (std::string row; std::getline(text, row);) {
    const auto values = nlohmann::json::parse(row, nullptr, false);
    if (values.is_object())
      rows.push_back(
          fmt::format("{} {} {}", values.value("stage", ""), values.value("step", 0), values["loss"].dump()));
  }
  return rows;
}

/// Waits until the training has reported a step of `stage` at least as high as `step`.
void wait_for(BackgroundVivant& training, const std::filesystem::path& run, const std::string& stage,
              int step) {
  while (training.runs()) {
    for (const std::string& row : metrics(run)) {
      std::istringstream words(row);
      std::string its_stage;
      int its_step = 0;
      words >> its_stage >> its_step;
      if (its_stage == stage && its_step >= step) return;
    }
    std::this_thread::sleep_for(5ms);
  }
  FAIL("the training ended before step " << step << " of " << stage);
}

void check_same(const std::filesystem::path& expected, const std::filesystem::path& run) {
  const auto a = RunFolder::open_to_read(expected).newest_checkpoint(),
             b = RunFolder::open_to_read(run).newest_checkpoint();
  REQUIRE(a);
  REQUIRE(b);
  CHECK(a->number == b->number);
  CHECK(b->damaged.empty());
  REQUIRE(a->checkpoint.tensors.size() == b->checkpoint.tensors.size());
  for (const auto& [name, tensor] : a->checkpoint.tensors) {
    CAPTURE(name);
    REQUIRE(b->checkpoint.tensors.contains(name));
    CHECK(b->checkpoint.tensors.at(name).bytes == tensor.bytes);
  }
  CHECK(metrics(run) == metrics(expected));
}

}  // namespace

TEST_CASE("resume: Ctrl-C in both stages and kill -9 at any moment leave no trace in the weights") {
  const TemporaryFolder folder;
  const std::filesystem::path log = folder / "log", whole = folder / "whole", stopped = folder / "stopped",
                              moved = folder / "moved", killed = folder / "killed";
  REQUIRE(BackgroundVivant(fresh(whole), log).finish() == 0);

  const auto begin = std::chrono::steady_clock::now();
  {
    BackgroundVivant training(fresh(stopped), log);
    wait_for(training, stopped, "scene", 3);
    CHECK(training.finish(SIGINT) == 130);
    CHECK(contains(read_whole_file(log), "go on with: vivant train --resume --run " + stopped.string()));
  }
  std::filesystem::rename(stopped, moved);
  {
    BackgroundVivant training(resumed(moved), log);
    wait_for(training, moved, "human", 3);
    CHECK(training.finish(SIGINT) == 130);
  }
  CHECK(BackgroundVivant(resumed(moved), log).finish() == 0);
  const std::chrono::duration<double> duration = std::chrono::steady_clock::now() - begin;
  check_same(whole, moved);

  std::random_device random;
  for (int life = 0; life < 3; ++life) {
    const auto moment = duration * std::uniform_real_distribution<double>(0, 0.7)(random);
    BackgroundVivant training(
        std::filesystem::exists(killed / "config.toml") ? resumed(killed) : fresh(killed), log);
    std::this_thread::sleep_for(moment);
    const int code = training.finish(SIGKILL);
    INFO("killed after ", moment.count(), " s: ", read_whole_file(log));
    CHECK((code == 0 || code == 128 + SIGKILL));
  }
  CHECK(BackgroundVivant(resumed(killed), log).finish() == 0);
  check_same(whole, killed);
}
