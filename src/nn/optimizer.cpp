#include "vivant/nn/optimizer.hpp"

#include <algorithm>
#include <cmath>

namespace vivant {

Optimizer::Optimizer(Device& device, Graph& graph, ParameterStore& store,
                     const std::vector<std::string>& names, const Values& gradients, Value loss,
                     const Options& options)
    : store_(store) {
  const Graph::Scope scope(graph, "optimizer");
  for (std::size_t i = 0; i < names.size(); ++i) store.place_gradient(graph, names[i], gradients[i]);
  const std::vector<std::uint8_t> table = store.group_table(options.trained);
  group_buffer_ = std::make_shared<Buffer>(device.allocate(table.size()));
  device.write(*group_buffer_, table.data(), table.size());
  if (options.stops_with) {
    status_buffer_ = options.stops_with->status_buffer_;
  } else {
    status_buffer_ = std::make_shared<Buffer>(device.allocate(3 * sizeof(std::int32_t)));
    device.fill(*status_buffer_, 0);
  }
  step_ = graph.scalar("step", DType::i32);
  rates_ = graph.input("learning rates", {options.groups});
  status_ = graph.external("status", {DType::i32, {3}}, {status_buffer_, 0});
  adam({.parameters = store.all_values(graph),
        .gradients = store.all_gradients(graph),
        .first_moments = store.all_first_moments(graph),
        .second_moments = store.all_second_moments(graph),
        .groups = graph.external("groups", {DType::u8, {static_cast<std::int64_t>(table.size())}},
                                 {group_buffer_, 0}),
        .rates = rates_,
        .step = step_,
        .status = status_,
        .loss = loss,
        .overflow = options.overflow},
       options.adam);
}

void Optimizer::set_step(Executor& executor, std::int64_t step, const std::vector<double>& rates) {
  executor.set(step_, static_cast<double>(step));
  executor.set(rates_, rates);
}

std::optional<TrainingFailure> Optimizer::failure(Executor& executor) {
  const std::vector<std::int32_t> status = executor.read_ints(status_);
  if (status[0] == 0) return std::nullopt;
  const auto failed = [&](const std::string& what) {
    return TrainingFailure{status[1], fmt::format("{} at step {}", what, status[1])};
  };
  if (status[0] == 3) return failed("an overflow");
  if (status[0] == 2) return failed("the loss is not finite");
  for (const ParameterStore::Parameter& parameter : store_.parameters())
    if (status[2] >= parameter.offset && status[2] < parameter.offset + parameter.shape.elements())
      return failed(fmt::format("the gradient of {} is not finite", parameter.name));
  return failed("a gradient is not finite");
}

std::optional<std::int64_t> Optimizer::overflowed_step(Executor& executor) {
  const std::vector<std::int32_t> status = executor.read_ints(status_);
  return status[0] == 3 ? std::optional<std::int64_t>(status[1]) : std::nullopt;
}

std::unique_ptr<Optimizer> optimise(Device& device, Graph& graph, ParameterStore& store, Value loss,
                                    const Optimizer::Options& options) {
  std::vector<std::string> names;
  Values parameters;
  for (const ParameterStore::Parameter& parameter : store.parameters())
    if (std::any_of(options.trained.begin(), options.trained.end(),
                    [&](const std::string& prefix) { return parameter.name.starts_with(prefix); })) {
      names.push_back(parameter.name);
      parameters.push_back(store.value(graph, parameter.name));
    }
  return std::make_unique<Optimizer>(device, graph, store, names, differentiate(graph, loss, parameters),
                                     loss, options);
}

double RateSchedule::rate(double base, std::int64_t step) const {
  const double done = static_cast<double>(step) / static_cast<double>(std::max<std::int64_t>(1, steps));
  const double warm =
      warmup > 0 ? std::min(1.0, static_cast<double>(step + 1) / static_cast<double>(warmup)) : 1.0;
  const double cool = cooldown > 0 ? std::clamp((1 - done) / cooldown, 0.0, 1.0) : 1.0;
  return base * warm * cool * std::pow(decay, done);
}

}  // namespace vivant
