#include "vivant/jobs/stage.hpp"

#include <set>

#include "vivant/jobs/interrupt.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

const std::pair<const char*, ParameterStore::Kind> kinds[] = {
    {"parameter/", ParameterStore::Kind::value},
    {"adam_m/", ParameterStore::Kind::first_moment},
    {"adam_v/", ParameterStore::Kind::second_moment}};

}  // namespace

void keep_training(Checkpoint& checkpoint, const ParameterStore& store) {
  for (const ParameterStore::Parameter& parameter : store.parameters())
    for (const auto& [prefix, kind] : kinds)
      checkpoint.tensors.emplace(
          prefix + parameter.name,
          HostTensor(parameter.shape.extents(), std::span<const float>(store.read(parameter.name, kind))));
}

std::filesystem::path save_training(const TrainingState& state, const std::string& stage, std::int64_t step) {
  Checkpoint checkpoint;
  checkpoint.stage = stage;
  checkpoint.step = step;
  checkpoint.seed = static_cast<std::uint64_t>(state.config.training.seed);
  checkpoint.config = to_toml(state.config);
  checkpoint.device_class = state.device.device_class() == DeviceClass::cpu ? "cpu" : "gpu";
  checkpoint.precision = "single";
  keep_training(checkpoint, state.store);
  return state.run.save(checkpoint, state.steps_before + step, state.config.training.checkpoints_kept);
}

void restore_training(const Checkpoint& checkpoint, ParameterStore& store) {
  std::set<std::string> known;
  for (const ParameterStore::Parameter& parameter : store.parameters())
    known.insert(kinds[0].first + parameter.name);
  for (const auto& [name, tensor] : checkpoint.tensors)
    if (name.starts_with(kinds[0].first) && !known.contains(name))
      fail("{}: holds '{}', which config.toml leaves out: set again what the run was made with",
           checkpoint.source, name);
  for (const ParameterStore::Parameter& parameter : store.parameters())
    for (const auto& [prefix, kind] : kinds) {
      const HostTensor& tensor = checkpoint.tensor(prefix + parameter.name, parameter.shape.extents());
      store.write(parameter.name, tensor.as_floats(), kind);
    }
}

namespace {

/// After a failure: keeps the state before the step that failed, and throws.
void check_health(const TrainingState& state, const std::string& stage, StageTrainer& trainer,
                  Progress& progress) {
  const std::optional<TrainingFailure> failure = trainer.failure();
  if (!failure) return;
  progress.end();
  const std::filesystem::path kept = save_training(state, stage, failure->step - 1);
  std::string op;
  try {
    trainer.diagnose(failure->step - 1);
  } catch (const Error& error) {
    op = fmt::format(": {}", error.what());
  }
  fail(
      "stage {}: {}{}; {} holds the state before it: lower the rates in {}, then go on with: vivant train "
      "--resume --run {}",
      stage, failure->what, op, kept.string(), state.run.config().string(), state.run.path().string());
}

}  // namespace

void run_stage(const TrainingState& state, const std::string& stage, StageTrainer& trainer,
               std::int64_t first, Progress& progress) {
  const auto& training = state.config.training;
  const std::int64_t steps = trainer.steps();
  progress.begin(stage, first, steps);
  for (std::int64_t step = first; step < steps; ++step) {
    trainer.run(step);
    const std::int64_t done = step + 1;
    const bool last = done == steps, stopped = interrupted();
    const auto due = [&](std::int64_t every) { return every > 0 && (done % every == 0 || last); };
    const bool reports = due(training.report_every) || stopped, previews = due(training.preview_every),
               saves = due(training.checkpoint_every) || stopped;
    if (reports) progress.report(trainer.report(done));
    if (reports || previews || saves) check_health(state, stage, trainer, progress);
    if (previews) trainer.preview(state.run.previews(), fmt::format("{}-{:06}", stage, done));
    if (saves) save_training(state, stage, done);
    if (stopped && !last) {
      progress.end();
      throw Interrupted(
          fmt::format("stopped at step {} of {} of stage {}; go on with: vivant train --resume --run {}",
                      done, steps, stage, state.run.path().string()));
    }
  }
  progress.end();
}

}  // namespace vivant
