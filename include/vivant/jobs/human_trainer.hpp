#pragma once
#include <memory>

#include "vivant/graph/executor.hpp"
#include "vivant/jobs/stage.hpp"
#include "vivant/model/canonical_points.hpp"
#include "vivant/model/human_model.hpp"
#include "vivant/model/human_rays.hpp"
#include "vivant/nn/optimizer.hpp"

namespace vivant {

/// How the rays of the training are traced.
HumanRayOptions human_ray_options(const Config& config);

/// Trains the person's field over a known background (specification 4, stage 1): half of the rays on the
/// person, half in a box around, frames mixed.
class HumanTrainer final : public StageTrainer {
 public:
  /// `backgrounds`: what stands behind the person in each training frame, see HumanRays.
  HumanTrainer(Device& device, const Config& config, const Capture& capture, ParameterStore& store,
               const HumanModel& model, const std::vector<cv::Mat>& backgrounds);

  std::int64_t steps() const override { return config_.human.steps; }
  void run(std::int64_t step) override;
  StepReport report(std::int64_t step) override;
  std::string failure() override;
  void diagnose() override { executor_->run_checked(); }
  void preview(const std::filesystem::path& folder, const std::string& stem) override;

  /// The terms of the loss of the last step, unweighted, by name.
  std::map<std::string, double> terms();
  const Executor& executor() const { return *executor_; }
  const HumanRays& rays() const { return rays_; }

 private:
  void loss_of_rays(Value planes);
  void loss_of_points(Value planes);
  void add_term(const std::string& name, Value term, double weight);
  RandomKey key(int stream) const { return {seed_, random_step_, stream}; }

  Device& device_;
  const Config& config_;
  const Capture& capture_;
  const HumanModel& model_;
  HumanRays rays_;
  CanonicalPoints points_;
  Graph graph_;
  Value seed_, random_step_, fade_, alpha_decay_, overflow_, loss_;
  std::vector<std::pair<std::string, Value>> terms_;
  std::unique_ptr<Optimizer> optimizer_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace vivant
