#pragma once
#include <memory>

#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/progress.hpp"
#include "vivant/jobs/stage.hpp"

namespace vivant {

/// Stage 2: the fields' hidden units are frozen, their 128 -> 256 layers learn to render
/// VGG-19's relu3_1, psi and the decoder to turn that into the picture. The layers start at the least-squares
/// fit, which is all that a frozen linear map can reach of the feature error. With features.hidden = trained
/// features have hidden layers of their own, which start as copies of the frozen ones and learn as well;
/// every step then renders its patch anew.
class FeatureTrainer final : public StageTrainer {
 public:
  /// Renders the training views first; `first_step` 0 also gives the trained layers their start. Throws
  /// Interrupted after Ctrl-C.
  FeatureTrainer(Device& device, const Config& config, const Capture& capture, CaptureModel& model,
                 Progress& progress, std::int64_t first_step);
  ~FeatureTrainer() override;

  std::int64_t steps() const override { return config_.features.steps; }
  void run(std::int64_t step) override;
  StepReport report(std::int64_t step) override;
  std::optional<TrainingFailure> failure() override;
  void diagnose(std::int64_t step) override;
  const Executor& executor() const override;
  /// Truth, rendered colours, and the decoder's picture of a training view.
  void preview(const std::filesystem::path& folder, const std::string& stem) override;

 private:
  struct State;
  void start();

  const Config& config_;
  std::unique_ptr<State> state_;
};

}  // namespace vivant
