#pragma once
#include <memory>
#include <string>
#include <vector>

#include "cases/op_case.hpp"
#include "vivant/graph/executor.hpp"

namespace vivant::cases {

/// The op of a case in a graph of its own, with the gradients of its differentiable inputs where asked for,
/// ready to run.
class CaseRun {
 public:
  CaseRun(Device& device, const OpCase& op_case, const Variation& variation, bool with_gradients,
          ExecutorOptions options = {});

  void upload();  ///< the inputs, and the weights of the outputs' sum
  void run() { executor_->run(); }
  Executor& executor() { return *executor_; }
  const std::vector<HostTensor>& inputs() const { return inputs_; }
  std::vector<HostTensor> outputs();  ///< of the last run; rows beyond a count are left out
  /// The gradient of sum_k outputs_k . weights_k by input; empty where there is none.
  std::vector<std::vector<double>> gradients();
  /// Bytes of all outputs and gradients, rows beyond a count left out: for bitwise comparisons.
  std::vector<std::uint8_t> bytes();
  /// Bytes that the gradients add at least: those of the outputs read, those of the inputs written, rows
  /// beyond a count left out.
  double gradient_bytes();
  double objective();  ///< sum_k outputs_k . weights_k, on the host in double
  void set_input(std::size_t index, const std::vector<double>& data);

 private:
  void write(Value value, const HostTensor& tensor);
  std::int64_t live_elements(Value value);
  std::vector<double> live(Value value, const std::vector<double>& data);

  std::vector<HostTensor> inputs_;
  std::vector<std::vector<double>> weights_;  // by output; empty for integers
  Graph graph_;
  Values in_, counts_, out_, seeds_, grads_;
  std::unique_ptr<Executor> executor_;
};

/// What a check found wrong; empty when all is well.
using Findings = std::vector<std::string>;

Findings check_values(Device& device, const OpCase& op_case, const Variation& variation);
Findings check_gradients(Device& device, const OpCase& op_case, const Variation& variation);
/// Squares of relative errors over all elements that were compared.
struct ErrorSum {
  double squares = 0, elements = 0;
};
/// Outputs against the reference and gradients against those in double, by relative rms error over each
/// tensor; the errors are added to `all`.
Findings check_rms_errors(Device& device, const OpCase& op_case, const Variation& variation, double tolerance,
                          ErrorSum& all);
Findings check_guards(Device& device, const OpCase& op_case, const Variation& variation);
Findings check_repeat(Device& device, const OpCase& op_case, const Variation& variation);

/// "op sizes attributes", for messages.
std::string describe(const OpCase& op_case, const Variation& variation);

}  // namespace vivant::cases
