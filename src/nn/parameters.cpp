#include "vivant/nn/parameters.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace vivant {

void ParameterStore::add(const std::string& name, Shape shape, int group, std::span<const float> values) {
  if (device_) fail("parameter {} is added after the store was allocated", name);
  if (static_cast<std::int64_t>(values.size()) != shape.elements())
    fail("parameter {} of shape {} gets {} first values", name, shape.text(), values.size());
  for (const Parameter& other : parameters_)
    if (other.name == name) fail("two parameters are called {}", name);
  parameters_.push_back({name, std::move(shape), group, elements_});
  first_values_.insert(first_values_.end(), values.begin(), values.end());
  elements_ += (static_cast<std::int64_t>(values.size()) + block - 1) / block * block;
  first_values_.resize(elements_, 0.0f);
}

void ParameterStore::allocate(Device& device) {
  device_ = &device;
  const std::size_t bytes = static_cast<std::size_t>(elements_) * sizeof(float);
  for (auto* buffer : {&values_, &gradients_, &first_moments_, &second_moments_}) {
    *buffer = std::make_shared<Buffer>(device.allocate(bytes));
    device.fill(**buffer, 0);
  }
  device.write(*values_, first_values_.data(), bytes);
  first_values_ = {};
}

const ParameterStore::Parameter& ParameterStore::find(const std::string& name) const {
  for (const Parameter& parameter : parameters_)
    if (parameter.name == name) return parameter;
  fail("there is no parameter {}", name);
}

Value ParameterStore::whole(Graph& graph, const std::string& name,
                            const std::shared_ptr<Buffer>& buffer) const {
  if (!device_) fail("the parameters are used before they were allocated");
  return graph.external(name, {DType::real, {elements_}}, {buffer, 0});
}

Value ParameterStore::all_values(Graph& graph) const { return whole(graph, "parameters", values_); }
Value ParameterStore::all_gradients(Graph& graph) const { return whole(graph, "gradients", gradients_); }
Value ParameterStore::all_first_moments(Graph& graph) const { return whole(graph, "adam_m", first_moments_); }
Value ParameterStore::all_second_moments(Graph& graph) const {
  return whole(graph, "adam_v", second_moments_);
}

Value ParameterStore::value(Graph& graph, const std::string& name) const {
  if (!device_) fail("the parameters are used before they were allocated");
  const Parameter& parameter = find(name);
  return graph.named(name, [&] {
    return graph.external(name, {DType::real, parameter.shape},
                          {values_, static_cast<std::size_t>(parameter.offset) * sizeof(float)});
  });
}

Values ParameterStore::values(Graph& graph, const std::string& prefix) const {
  Values result;
  for (const Parameter& parameter : parameters_)
    if (parameter.name.starts_with(prefix)) result.push_back(value(graph, parameter.name));
  return result;
}

void ParameterStore::place_gradient(Graph& graph, const std::string& name, Value gradient) const {
  const Parameter& parameter = find(name);
  const Value target =
      graph.external("gradient of " + name, {DType::real, parameter.shape},
                     {gradients_, static_cast<std::size_t>(parameter.offset) * sizeof(float)});
  graph.assign(target, gradient);
}

std::vector<std::uint8_t> ParameterStore::group_table(
    const std::vector<std::string>& trained_prefixes) const {
  std::vector<std::uint8_t> table(elements_ / block, frozen);
  for (const Parameter& parameter : parameters_) {
    const bool trained =
        std::any_of(trained_prefixes.begin(), trained_prefixes.end(),
                    [&](const std::string& prefix) { return parameter.name.starts_with(prefix); });
    const std::int64_t first = parameter.offset / block;
    const std::int64_t count = (parameter.shape.elements() + block - 1) / block;
    if (trained) std::fill_n(table.begin() + first, count, static_cast<std::uint8_t>(parameter.group));
  }
  return table;
}

const std::shared_ptr<Buffer>& ParameterStore::buffer_of(Kind kind) const {
  return kind == Kind::value ? values_ : kind == Kind::first_moment ? first_moments_ : second_moments_;
}

std::vector<float> ParameterStore::read(const std::string& name, Kind kind) const {
  const Parameter& parameter = find(name);
  std::vector<float> data(parameter.shape.elements());
  device_->read(*buffer_of(kind), data.data(), data.size() * sizeof(float), parameter.offset * sizeof(float));
  return data;
}

void ParameterStore::write(const std::string& name, std::span<const float> data, Kind kind) {
  const Parameter& parameter = find(name);
  if (static_cast<std::int64_t>(data.size()) != parameter.shape.elements())
    fail("parameter {} has shape {}, the data {} elements", name, parameter.shape.text(), data.size());
  device_->write(*buffer_of(kind), data.data(), data.size_bytes(), parameter.offset * sizeof(float));
}

void ParameterStore::clear_moments() {
  device_->fill(*first_moments_, 0);
  device_->fill(*second_moments_, 0);
}

std::vector<float> Initializer::normal(const std::string& name, std::int64_t elements,
                                       double deviation) const {
  std::uint64_t hash = 14695981039346656037ull ^ seed_;  // FNV-1a: the same on every platform
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  std::mt19937_64 generator(hash);
  const auto uniform = [&] { return (static_cast<double>(generator() >> 11) + 0.5) * 0x1p-53; };
  std::vector<float> values(elements);
  for (float& value : values)
    value = static_cast<float>(deviation * std::sqrt(-2 * std::log(uniform())) *
                               std::cos(2 * std::numbers::pi * uniform()));
  return values;
}

std::vector<float> Initializer::he(const std::string& name, std::int64_t elements, std::int64_t inputs,
                                   double scale) const {
  return normal(name, elements, scale * std::sqrt(2.0 / static_cast<double>(inputs)));
}

}  // namespace vivant
