#pragma once
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "vivant/graph/executor.hpp"
#include "vivant/io/tensor_file.hpp"
#include "vivant/nn/optimizer.hpp"

namespace vivant::bench {

/// Where uniform random numbers lie.
struct Range {
  double low = -1, high = 1;
};

/// Uniform numbers that depend on the name alone.
std::vector<float> numbers(const std::string& name, std::int64_t count, Range range = {});

/// A piece of work of the comparison with other programs: a graph of the project's own ops and models with
/// numbers in it. `inputs` holds all that another program needs to compute the same.
class Workload {
 public:
  virtual ~Workload() = default;

  const TensorFile& inputs() const { return inputs_; }
  /// Does the work once and waits for the device.
  virtual void run();
  /// What the last run computed, by name. Training steps: what the first one computed.
  virtual TensorFile results();
  const Executor& executor() const { return *executor_; }

 protected:
  explicit Workload(Device& device) : device_(device) {}

  /// An input of the graph with random numbers, or with given ones.
  Value input(const std::string& name, const Shape& shape, Range range = {});
  Value given(const std::string& name, const Shape& shape, std::span<const float> data);
  /// Makes tensors known to other programs that are no inputs of the graph.
  void publish(const std::string& name, const Shape& shape, std::span<const float> data);
  void publish(const ParameterStore& store);
  /// Prepares the graph to compute `outputs`, and writes its inputs.
  void prepare(const std::map<std::string, Value>& outputs);

  Device& device_;
  ParameterStore store_;
  Graph graph_;
  std::unique_ptr<Executor> executor_;

 private:
  TensorFile inputs_;
  std::vector<std::pair<Value, std::string>> graph_inputs_;
  std::map<std::string, Value> outputs_;
};

/// A workload that ends in a step of Adam on parameters of `store_`, rate 1e-4, if `train` is called.
class TrainingWorkload : public Workload {
 public:
  void run() override;
  /// Adds the gradients of the first step, "gradient of <parameter>".
  TensorFile results() override;

 protected:
  explicit TrainingWorkload(Device& device) : Workload(device) {}
  /// Trains the parameters whose names start with one of `trained`; to be called before `prepare`.
  void train(Value loss, const std::vector<std::string>& trained);

 private:
  static constexpr AdamOptions adam_ = {};
  std::vector<std::string> trained_;
  std::unique_ptr<Optimizer> optimizer_;
  std::int64_t step_ = 0;
};

using Sizes = nlohmann::json;
using MakeWorkload = std::unique_ptr<Workload> (*)(Device&, const Sizes&);

template <typename W>
std::unique_ptr<Workload> make(Device& device, const Sizes& sizes) {
  return std::make_unique<W>(device, sizes);
}

// One function for each file of workloads: how they are made, by name.
using WorkloadTable = std::map<std::string, MakeWorkload>;
WorkloadTable op_workloads();
WorkloadTable field_workloads();
WorkloadTable style_workloads();

}  // namespace vivant::bench
