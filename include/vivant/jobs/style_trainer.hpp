#pragma once
#include <filesystem>
#include <memory>

#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/progress.hpp"
#include "vivant/jobs/stage.hpp"

namespace vivant {

/// Stage 3: the fields are frozen; psi and the decoder are tuned on what they render of
/// training views, an orbit and novel poses, with AdaAttN's losses over many paintings. Every third step
/// takes stage 2's loss, so that content stays readable.
class StyleTrainer final : public StageTrainer {
 public:
  /// Renders the views first. `styles`: a folder of paintings. Throws Interrupted after Ctrl-C.
  StyleTrainer(Device& device, const Config& config, const Capture& capture, CaptureModel& model,
               const std::filesystem::path& styles, Progress& progress);
  ~StyleTrainer() override;

  std::int64_t steps() const override { return config_.style.steps; }
  void run(std::int64_t step) override;
  StepReport report(std::int64_t step) override;
  std::optional<TrainingFailure> failure() override;
  void diagnose(std::int64_t step) override;
  const Executor& executor() const override;
  /// A training view in some of the styles.
  void preview(const std::filesystem::path& folder, const std::string& stem) override;

 private:
  struct State;

  const Config& config_;
  std::unique_ptr<State> state_;
};

}  // namespace vivant
