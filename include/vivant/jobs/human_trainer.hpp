#pragma once
#include <memory>

#include "vivant/jobs/human_step.hpp"
#include "vivant/jobs/stage.hpp"

namespace vivant {

/// How the rays of the training are traced, and how soft their masks are: as stored with exact poses.
HumanRayOptions human_ray_options(const Config& config, bool exact_poses);

/// Trains the person's field over a known background: half of the rays on the
/// person, half in a box around, frames mixed. A batch whose samples do not fit into the memory planned for
/// them is repeated with more.
class HumanTrainer final : public StageTrainer {
 public:
  /// `backgrounds`: what stands behind the person in each training frame, see HumanRays. `room`: how many
  /// samples of a batch there is room for, in parts of their mean number.
  HumanTrainer(Device& device, const Config& config, const Capture& capture, ParameterStore& store,
               const HumanModel& model, const std::vector<cv::Mat>& backgrounds, double room = 1.25);

  std::int64_t steps() const override { return config_.human.steps; }
  void run(std::int64_t step) override;
  StepReport report(std::int64_t step) override;
  std::optional<TrainingFailure> failure() override;
  void diagnose(std::int64_t step) override;
  void preview(const std::filesystem::path& folder, const std::string& stem) override;

  /// The terms of the loss of the last step, unweighted, by name.
  std::map<std::string, double> terms() { return latest().terms(); }
  const Executor& executor() const override { return usual_->executor(); }
  const HumanRays& rays() const { return rays_; }
  /// How many steps have been repeated so far.
  std::int64_t repeated_steps() const { return repeated_steps_; }

 private:
  std::unique_ptr<HumanStep> make_step(std::int64_t capacity);
  void repeat_overflowed_steps();
  /// What ran the last step.
  HumanStep& latest();

  Device& device_;
  const Config& config_;
  const Capture& capture_;
  ParameterStore& store_;
  const HumanModel& model_;
  HumanRays rays_;
  CanonicalPoints points_;
  std::int64_t most_samples_ = 0, capacity_ = 0, last_step_ = -1, repeated_steps_ = 0, reported_step_ = -1;
  std::unique_ptr<HumanStep> usual_, larger_;  // larger_: only while the last step is one that was repeated
  std::optional<TrainingFailure> failure_;
};

}  // namespace vivant
