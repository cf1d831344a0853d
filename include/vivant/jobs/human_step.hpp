#pragma once
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "vivant/graph/executor.hpp"
#include "vivant/jobs/config.hpp"
#include "vivant/model/canonical_points.hpp"
#include "vivant/model/human_model.hpp"
#include "vivant/model/human_rays.hpp"
#include "vivant/nn/optimizer.hpp"

namespace vivant {

/// One optimizer step of the person's field as a graph: losses on rays and on points, gradients, Adam.
class HumanStep {
 public:
  /// `capacity`: how many samples of a batch there is room for. All arguments must outlive the step.
  HumanStep(Device& device, const Config& config, ParameterStore& store, const HumanModel& model,
            const HumanRays& rays, const CanonicalPoints& points, std::int64_t capacity);

  /// Enqueues step `step` (from 0); does not wait. When the samples do not fit, nothing is updated, in this
  /// step and all later ones.
  void run(std::int64_t step);
  double loss();
  /// Of the colours of the last step's rays, the person over the known background: the mean over rays and
  /// channels.
  double squared_error();
  /// The terms of the loss of the last step, unweighted, by name.
  std::map<std::string, double> terms();
  Optimizer& optimizer() { return *optimizer_; }
  Executor& executor() { return *executor_; }

 private:
  void loss_of_rays(Value planes, std::int64_t capacity);
  void loss_of_points(Value planes);
  void add_term(const std::string& name, Value term, double weight);
  RandomKey key(int stream) const { return {seed_, random_step_, stream}; }

  const Config& config_;
  const HumanModel& model_;
  const HumanRays& rays_;
  const CanonicalPoints& points_;
  Graph graph_;
  Value seed_, random_step_, fade_, alpha_decay_, overflow_, loss_, squared_error_;
  std::vector<std::pair<std::string, Value>> terms_;
  std::unique_ptr<Optimizer> optimizer_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace vivant
