#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "vivant/graph/executor.hpp"
#include "vivant/io/checkpoint.hpp"
#include "vivant/jobs/config.hpp"
#include "vivant/jobs/progress.hpp"
#include "vivant/jobs/run_folder.hpp"
#include "vivant/nn/optimizer.hpp"

namespace vivant {

/// One stage of the training as the loop sees it: steps that are enqueued one by one, and what can be said of
/// them.
class StageTrainer {
 public:
  virtual ~StageTrainer() = default;
  virtual std::int64_t steps() const = 0;
  /// Enqueues step `step` (from 0); does not wait.
  virtual void run(std::int64_t step) = 0;
  /// Waits, and says what the last step gave.
  virtual StepReport report(std::int64_t step) = 0;
  /// What went wrong since the start. After a failure all that is trained stays as it was before the step
  /// that failed. Asked before the parameters are read: steps that must be repeated are, here.
  virtual std::optional<TrainingFailure> failure() = 0;
  /// Runs step `step` (from 0), which failed, again op by op and throws an Error that names the first op that
  /// gave no finite number.
  virtual void diagnose(std::int64_t step) = 0;
  /// The graph of the last step, for plans and drawings.
  virtual const Executor& executor() const = 0;
  /// Writes a picture of the state, with the given stem, into `folder`.
  virtual void preview(const std::filesystem::path& folder, const std::string& stem) = 0;
};

/// Where a training run stands, and how it is saved.
struct TrainingState {
  const RunFolder& run;
  const Config& config;
  Device& device;
  ParameterStore& store;
  std::int64_t steps_before = 0;  ///< of the stages before this one: checkpoints are numbered over all stages
};

/// Saves the state after `step` steps of `stage`; returns the checkpoint's path.
std::filesystem::path save_training(const TrainingState& state, const std::string& stage, std::int64_t step);
/// Puts all parameters and their moments into a checkpoint.
void keep_training(Checkpoint& checkpoint, const ParameterStore& store);
/// Puts parameters and moments of a checkpoint back.
void restore_training(const Checkpoint& checkpoint, ParameterStore& store);

/// Runs a stage from step `first` to its end: reports, previews, checkpoints. Ctrl-C saves and throws
/// Interrupted; a loss or gradient that is not finite saves the state before its step, under the number of
/// that state, and throws Error naming the op and the checkpoint.
void run_stage(const TrainingState& state, const std::string& stage, StageTrainer& trainer,
               std::int64_t first, Progress& progress);

}  // namespace vivant
