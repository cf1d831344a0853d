#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vivant/graph/executor.hpp"
#include "vivant/nn/parameters.hpp"
#include "vivant/ops/adam.hpp"

namespace vivant {

/// Why a training cannot go on.
struct TrainingFailure {
  std::int64_t step = 0;  ///< 1 first: the parameters are those after the step before it
  std::string what;       ///< which quantity was not finite at which step
};

/// Adam over some of a store's parameters, as the last nodes of a training graph. The gradients of all
/// trained parameters go into the store's gradient buffer, and one launch updates everything.
class Optimizer {
 public:
  struct Options {
    std::vector<std::string> trained;  ///< prefixes of the names that are trained; the rest is frozen
    int groups = 1;                    ///< learning rates
    AdamOptions adam = {};
    Value overflow = {};  ///< i32 [1] or absent: when not 0, this step and the later ones update nothing
    const Optimizer* stops_with = nullptr;  ///< when one of the two fails, neither updates anything any more
  };
  /// `names[i]` has the gradient `gradients[i]`; together they must be all trained parameters.
  Optimizer(Device& device, Graph& graph, ParameterStore& store, const std::vector<std::string>& names,
            const Values& gradients, Value loss, const Options& options);

  /// Sets what one step needs: its number, 1 first, and the learning rate of each group.
  void set_step(Executor& executor, std::int64_t step, const std::vector<double>& rates);

  /// What went wrong since the start. Waits for the device.
  std::optional<TrainingFailure> failure(Executor& executor);
  /// i32 [3]: its first element is not 0 once this step or an earlier one has failed; for other state that
  /// is updated with the parameters.
  Value status() const { return status_; }
  /// The step (1 first) that overflowed, since which nothing is updated; none when all went well. Waits.
  std::optional<std::int64_t> overflowed_step(Executor& executor);
  /// Lets updates go on.
  void clear_status(Device& device) { device.fill(*status_buffer_, 0); }

 private:
  ParameterStore& store_;
  Value step_, rates_, status_;
  std::shared_ptr<Buffer> status_buffer_, group_buffer_;
};

/// Adds the gradients of `loss` for all parameters that `options.trained` names, and Adam on them.
std::unique_ptr<Optimizer> optimise(Device& device, Graph& graph, ParameterStore& store, Value loss,
                                    const Optimizer::Options& options);

/// How learning rates change over the steps: a linear warm-up, an exponential decay to `decay` times the base
/// and, on top of it, a linear fall to zero over the last part of the steps, of which `cooldown` is the
/// share: a high rate learns fast, and its noise goes at the end.
struct RateSchedule {
  std::int64_t steps = 1, warmup = 0;
  double decay = 1, cooldown = 0;

  /// The rate at `step`, from 0.
  double rate(double base, std::int64_t step) const;
};

}  // namespace vivant
