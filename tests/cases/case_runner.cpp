#include "cases/case_runner.hpp"

#include <fmt/ranges.h>

#include <cmath>
#include <set>

#include "vivant/ops/registry.hpp"

namespace vivant::cases {
namespace {

constexpr std::uint64_t input_seed = 11, weight_seed = 97;
constexpr int differences_per_input = 12;

double rms(const std::vector<double>& data) {
  double sum = 0;
  for (double x : data) sum += x * x;
  return data.empty() ? 0 : std::sqrt(sum / static_cast<double>(data.size()));
}

void compare(const std::string& what, const std::vector<double>& got, const std::vector<double>& want,
             double tolerance, Findings& findings) {
  if (got.size() != want.size()) {
    findings.push_back(fmt::format("{}: {} elements, the reference has {}", what, got.size(), want.size()));
    return;
  }
  const double scale = rms(want);
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (std::abs(got[i] - want[i]) <= tolerance * (std::abs(want[i]) + scale)) continue;  // false for NaN
    findings.push_back(
        fmt::format("{}: element {} is {:.9g}, it should be {:.9g}", what, i, got[i], want[i]));
    return;
  }
}

}  // namespace

std::string describe(const OpCase& op_case, const Variation& variation) {
  return fmt::format("{} {} {}", op_case.op, fmt::join(variation.sizes, "x"), variation.attributes.dump());
}

CaseRun::CaseRun(Device& device, const OpCase& op_case, const Variation& variation, bool with_gradients,
                 ExecutorOptions options) {
  Random random(input_seed);
  inputs_ = op_case.inputs(variation, random);
  const OpInfo& info = op_info(op_case.op);
  if (inputs_.size() != info.inputs.size())
    fail("the case of {} gives {} inputs, the op takes {}", op_case.op, inputs_.size(), info.inputs.size());
  Values arguments;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const HostTensor& tensor = inputs_[i];
    in_.push_back(tensor.absent ? Value{} : graph_.input(info.inputs[i].name, tensor.shape, tensor.dtype));
    counts_.push_back(tensor.live_rows < 0 ? Value{} : graph_.input("count", {1}, DType::i32));
    arguments.push_back(counts_.back() ? graph_.with_count(in_.back(), counts_.back()) : in_.back());
  }
  out_ = info.build(graph_, arguments, info.complete(variation.attributes));
  Random weight_random(weight_seed);
  Values real_outputs, wrt;
  for (const Value& out : out_) {
    weights_.emplace_back();
    if (out.dtype() != DType::real) continue;
    weights_.back() = weight_random.tensor(out.shape()).data;
    real_outputs.push_back(out);
    const Value seed = graph_.input("weights", out.shape());
    seeds_.push_back(seed);
  }
  grads_.resize(inputs_.size());
  Values kept = out_;
  if (with_gradients) {
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      if (in_[i] && inputs_[i].dtype == DType::real && inputs_[i].differentiable) wrt.push_back(arguments[i]);
    Values seeds;
    for (std::size_t k = 0; k < seeds_.size(); ++k)
      seeds.push_back(graph_.with_count(seeds_[k], real_outputs[k].count()));
    const Values grads = wrt.empty() ? Values{} : differentiate(graph_, real_outputs, seeds, wrt);
    for (std::size_t i = 0, k = 0; i < inputs_.size(); ++i)
      if (in_[i] && inputs_[i].dtype == DType::real && inputs_[i].differentiable) grads_[i] = grads[k++];
    kept.insert(kept.end(), grads.begin(), grads.end());
  }
  executor_ = std::make_unique<Executor>(device, graph_, kept, options);
  upload();
}

void CaseRun::write(Value value, const HostTensor& tensor) {
  if (tensor.dtype == DType::real) return executor_->write(value, std::span<const double>(tensor.data));
  if (tensor.dtype == DType::i32) {
    const std::vector<std::int32_t> ints(tensor.data.begin(), tensor.data.end());
    return executor_->write(value, std::span<const std::int32_t>(ints));
  }
  const std::vector<std::uint8_t> bytes(tensor.data.begin(), tensor.data.end());
  executor_->write(value, std::span<const std::uint8_t>(bytes));
}

void CaseRun::upload() {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (in_[i]) write(in_[i], inputs_[i]);
    if (counts_[i]) executor_->set(counts_[i], static_cast<double>(inputs_[i].live_rows));
  }
  std::size_t k = 0;
  for (const auto& weights : weights_)
    if (!weights.empty()) executor_->write(seeds_[k++], std::span<const double>(weights));
}

void CaseRun::set_input(std::size_t index, const std::vector<double>& data) {
  executor_->write(in_[index], std::span<const double>(data));
}

std::int64_t CaseRun::live_elements(Value value) {
  const Value count = value.count();
  if (!count) return value.elements();
  return executor_->read_ints(count)[0] * (value.elements() / value.shape()[0]);
}

std::vector<double> CaseRun::live(Value value, const std::vector<double>& data) {
  return {data.begin(), data.begin() + live_elements(value)};
}

std::vector<HostTensor> CaseRun::outputs() {
  std::vector<HostTensor> result;
  for (const Value& out : out_) {
    HostTensor tensor;
    tensor.dtype = out.dtype();
    tensor.shape = out.shape();
    if (out.dtype() == DType::real) {
      tensor.data = executor_->read_doubles(out);
    } else if (out.dtype() == DType::i32) {
      const auto ints = executor_->read_ints(out);
      tensor.data.assign(ints.begin(), ints.end());
    } else {
      const auto bytes = executor_->read_bytes(out);
      tensor.data.assign(bytes.begin(), bytes.end());
    }
    tensor.data = live(out, tensor.data);
    result.push_back(std::move(tensor));
  }
  return result;
}

std::vector<std::vector<double>> CaseRun::gradients() {
  std::vector<std::vector<double>> result;
  for (const Value& grad : grads_)
    result.push_back(grad ? live(grad, executor_->read_doubles(grad)) : std::vector<double>{});
  return result;
}

std::vector<std::uint8_t> CaseRun::bytes() {
  std::vector<std::uint8_t> all;
  const auto append = [&](Value value) {
    if (!value) return;
    std::vector<std::uint8_t> part = executor_->read_bytes(value);
    part.resize(part.size() / value.elements() * live_elements(value));
    all.insert(all.end(), part.begin(), part.end());
  };
  for (const Value& out : out_) append(out);
  for (const Value& grad : grads_) append(grad);
  return all;
}

double CaseRun::gradient_bytes() {
  std::set<int> seen;  // a gradient that is an output's as it stands moves nothing
  for (const Value& seed : seeds_) seen.insert(graph_.root(seed.id));
  std::int64_t elements = 0;
  for (const Value& grad : grads_)
    if (grad && seen.insert(graph_.root(grad.id)).second) elements += live_elements(grad);
  if (elements == 0) return 0;
  for (const Value& out : out_)
    if (out.dtype() == DType::real) elements += live_elements(out);
  return static_cast<double>(elements) * sizeof(float);
}

double CaseRun::objective() {
  const std::vector<HostTensor> outs = outputs();
  double sum = 0;
  for (std::size_t k = 0; k < outs.size(); ++k)
    for (std::size_t i = 0; i < std::min(outs[k].data.size(), weights_[k].size()); ++i)
      sum += outs[k].data[i] * weights_[k][i];
  return sum;
}

namespace {

/// The objective's central difference along a direction of one input.
double slope(CaseRun& forward, const OpCase& op_case, std::size_t input,
             const std::vector<double>& direction) {
  const auto objective_at = [&](double distance) {
    std::vector<double> moved = forward.inputs()[input].data;
    for (std::size_t e = 0; e < moved.size(); ++e) moved[e] += distance * direction[e];
    forward.set_input(input, moved);
    forward.run();
    return forward.objective();
  };
  const double difference = objective_at(op_case.step) - objective_at(-op_case.step);
  forward.set_input(input, forward.inputs()[input].data);
  return difference / (2 * op_case.step);
}

/// A gradient against central differences: single elements drawn at random, then all at once in a random
/// direction, where what the draw has missed shows.
void compare_with_differences(CaseRun& forward, const OpCase& op_case, std::size_t input,
                              const std::vector<double>& gradient, Random& random, const std::string& what,
                              Findings& findings) {
  const std::size_t elements = forward.inputs()[input].data.size();  // the gradient has the live rows alone
  std::vector<double> analytic, numeric;
  for (int d = 0; d < differences_per_input; ++d) {
    const std::size_t e = random.integer(static_cast<std::int64_t>(gradient.size()));
    std::vector<double> one(elements, 0.0);
    one[e] = 1;
    analytic.push_back(gradient[e]);
    numeric.push_back(slope(forward, op_case, input, one));
  }
  compare(what, analytic, numeric, op_case.gradient_tolerance, findings);
  std::vector<double> signs(elements);
  for (double& sign : signs) sign = random.uniform() < 0.5 ? -1 : 1;
  double along = 0, square = 0;
  for (std::size_t e = 0; e < gradient.size(); ++e) {
    along += signs[e] * gradient[e];
    square += gradient[e] * gradient[e];
  }
  const double measured = slope(forward, op_case, input, signs);
  if (!std::isfinite(square) ||
      !(std::abs(along - measured) <= op_case.gradient_tolerance * std::sqrt(square)))
    findings.push_back(
        fmt::format("{}: along a random direction it is {:.9g}, it should be {:.9g}", what, along, measured));
}

}  // namespace

Findings check_values(Device& device, const OpCase& op_case, const Variation& variation) {
  Findings findings;
  CaseRun run(device, op_case, variation, false);
  run.executor().scramble(0xFF);
  run.run();
  const auto got = run.outputs();
  const auto want = op_case.reference(variation, run.inputs());
  if (got.size() != want.size())
    return {fmt::format("{} outputs, the reference has {}", got.size(), want.size())};
  for (std::size_t k = 0; k < got.size(); ++k) {
    const std::string what = fmt::format("{}: output {}", describe(op_case, variation), k);
    if (got[k].shape != want[k].shape)
      findings.push_back(what + ": shape " + got[k].shape.text() + ", the reference has " +
                         want[k].shape.text());
    else
      compare(what, got[k].data, want[k].data, got[k].dtype == DType::real ? op_case.tolerance : 0, findings);
  }
  return findings;
}

Findings check_gradients(Device& device, const OpCase& op_case, const Variation& variation) {
  Findings findings;
  ExecutorOptions wide;
  wide.precision = Precision::double_;
  CaseRun run(device, op_case, variation, true, wide);
  run.executor().scramble(0xFF);
  run.run();
  const auto gradients = run.gradients();
  CaseRun forward(device, op_case, variation, false, wide);
  Random random(5);
  for (std::size_t i = 0; i < gradients.size(); ++i)
    if (!gradients[i].empty())
      compare_with_differences(forward, op_case, i, gradients[i], random,
                               fmt::format("{}: gradient of input {}", describe(op_case, variation), i),
                               findings);
  // The float kernels must agree with the double kernels.
  CaseRun single(device, op_case, variation, true);
  single.executor().scramble(0xFF);
  single.run();
  const auto narrow = single.gradients();
  for (std::size_t i = 0; i < gradients.size(); ++i)
    compare(fmt::format("{}: float gradient of input {}", describe(op_case, variation), i), narrow[i],
            gradients[i], 10 * op_case.tolerance, findings);
  return findings;
}

Findings check_rms_errors(Device& device, const OpCase& op_case, const Variation& variation, double tolerance,
                          ErrorSum& all) {
  Findings findings;
  const auto compare_rms = [&](const std::string& what, const std::vector<double>& got,
                               const std::vector<double>& want) {
    std::vector<double> difference(want.size());
    for (std::size_t i = 0; i < want.size(); ++i) difference[i] = got.at(i) - want[i];
    const double scale = rms(want), error = scale == 0 ? rms(difference) : rms(difference) / scale;
    all.squares += error * error * static_cast<double>(want.size());
    all.elements += static_cast<double>(want.size());
    if (!(error <= tolerance))
      findings.push_back(fmt::format("{}: {}: relative rms error {:.3g}, at most {:.3g} is allowed",
                                     describe(op_case, variation), what, error, tolerance));
  };
  CaseRun run(device, op_case, variation, true);
  run.executor().scramble(0xFF);
  run.run();
  const auto got = run.outputs(), want = op_case.reference(variation, run.inputs());
  for (std::size_t k = 0; k < want.size(); ++k)
    if (want[k].dtype == DType::real) compare_rms(fmt::format("output {}", k), got[k].data, want[k].data);
  if (device.math() == Math::bf16 && op_case.has_kinks(variation)) return findings;
  ExecutorOptions wide;
  wide.precision = Precision::double_;
  CaseRun exact(device, op_case, variation, true, wide);
  exact.run();
  const auto gradients = run.gradients(), exact_gradients = exact.gradients();
  for (std::size_t i = 0; i < gradients.size(); ++i)
    compare_rms(fmt::format("gradient of input {}", i), gradients[i], exact_gradients[i]);
  return findings;
}

Findings check_guards(Device& device, const OpCase& op_case, const Variation& variation) {
  ExecutorOptions options;
  options.guard_bytes = 4096;
  try {
    CaseRun run(device, op_case, variation, true, options);
    run.run();
    run.executor().check_guards();
  } catch (const Error& error) {
    return {describe(op_case, variation) + ": " + error.what()};
  }
  return {};
}

Findings check_repeat(Device& device, const OpCase& op_case, const Variation& variation) {
  CaseRun run(device, op_case, variation, true);
  run.executor().scramble(0xFF);
  run.run();
  const auto first = run.bytes();
  run.executor().scramble(0x3B);
  run.run();
  if (run.bytes() != first) return {describe(op_case, variation) + ": a second run gave other bits"};
  return {};
}

}  // namespace vivant::cases
