#include "workload.hpp"

#include <algorithm>

namespace vivant::bench {
namespace {

constexpr double rate = 1e-4;
constexpr int groups = 8;

}  // namespace

std::vector<float> numbers(const std::string& name, std::int64_t count, Range range) {
  std::uint64_t state = 14695981039346656037ull;  // FNV-1a of the name, then a linear congruence
  for (const unsigned char letter : name) state = (state ^ letter) * 1099511628211ull;
  std::vector<float> values(static_cast<std::size_t>(count));
  for (float& value : values) {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    const double unit = static_cast<double>(state >> 40) / static_cast<double>(1 << 24);
    value = static_cast<float>(range.low + (range.high - range.low) * unit);
  }
  return values;
}

void Workload::run() {
  executor_->run();
  device_.finish();
}

TensorFile Workload::results() {
  TensorFile file;
  for (const auto& [name, value] : outputs_)
    file.tensors[name] = HostTensor(value.shape().extents(), std::span<const float>(executor_->read(value)));
  return file;
}

Value Workload::input(const std::string& name, const Shape& shape, Range range) {
  return given(name, shape, numbers(name, shape.elements(), range));
}

Value Workload::given(const std::string& name, const Shape& shape, std::span<const float> data) {
  publish(name, shape, data);
  const Value value = graph_.input(name, shape);
  graph_inputs_.emplace_back(value, name);
  return value;
}

void Workload::publish(const std::string& name, const Shape& shape, std::span<const float> data) {
  inputs_.tensors[name] = HostTensor(shape.extents(), data);
}

void Workload::publish(const ParameterStore& store) {
  for (const ParameterStore::Parameter& parameter : store.parameters())
    publish(parameter.name, parameter.shape, store.read(parameter.name));
}

void Workload::prepare(const std::map<std::string, Value>& outputs) {
  outputs_ = outputs;
  Values values;
  for (const auto& [name, value] : outputs) values.push_back(value);
  executor_ = std::make_unique<Executor>(device_, graph_, values);
  for (const auto& [value, name] : graph_inputs_)
    executor_->write(value, std::span<const float>(inputs_.at(name).as_floats()));
}

void TrainingWorkload::train(Value loss, const std::vector<std::string>& trained) {
  trained_ = trained;
  optimizer_ = optimise(device_, graph_, store_, loss, {.trained = trained, .groups = groups, .adam = adam_});
}

void TrainingWorkload::run() {
  ++step_;
  if (optimizer_) optimizer_->set_step(*executor_, step_, std::vector<double>(groups, rate));
  Workload::run();
}

TensorFile TrainingWorkload::results() {
  if (!optimizer_) return Workload::results();
  if (step_ != 1)
    fail("the results of a training workload are those of its first step, this was step {}", step_);
  TensorFile file = Workload::results();
  for (const ParameterStore::Parameter& parameter : store_.parameters()) {
    const bool is_trained = std::any_of(trained_.begin(), trained_.end(), [&](const std::string& prefix) {
      return parameter.name.starts_with(prefix);
    });
    if (!is_trained) continue;
    // Moments start at zero.
    std::vector<float> gradient = store_.read(parameter.name, ParameterStore::Kind::first_moment);
    for (float& number : gradient) number = static_cast<float>(number / (1 - adam_.beta1));
    file.tensors["gradient of " + parameter.name] =
        HostTensor(parameter.shape.extents(), std::span<const float>(gradient));
  }
  return file;
}

}  // namespace vivant::bench
