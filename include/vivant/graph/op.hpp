#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "vivant/graph/types.hpp"

namespace vivant {

class Graph;
class Launch;
struct Value;
using Values = std::vector<Value>;

/// What Op::gradient gets: the op's inputs and outputs, the gradients of its outputs (absent where no
/// gradient flows), and which inputs want one.
struct GradientRequest {
  Graph& graph;
  const Values& in;
  const Values& out;
  const Values& grad_out;
  const std::vector<bool>& needed;

  /// The gradient of output i, as zeros where none flows.
  Value grad(int i = 0) const;
};

/// One operation with its parameters as const members. It knows its shapes, its kernels and its gradient; it
/// holds no tensors and no state, so that one op serves any number of runs.
class Op {
 public:
  virtual ~Op() = default;
  virtual std::string_view name() const = 0;
  /// Types of the outputs. Throws `[name] what is wrong` when the inputs do not fit; an absent input has rank
  /// 0. An op that works row by row passes the count of its input on; see `accepts_counts`.
  virtual TensorTypes infer(const TensorTypes& in) const = 0;
  /// Scratch memory that lives during the launch alone.
  virtual TensorTypes workspaces(const TensorTypes& /*in*/) const { return {}; }
  /// Prepares the kernels of one run; called once, when the executor plans.
  virtual void launch(Launch& launch) const = 0;
  /// Records the nodes of the gradient and returns one value per input, absent where none is needed or none
  /// exists.
  virtual Values gradient(const GradientRequest& request) const;
  /// Whether inputs with a device-side count of live rows are understood.
  virtual bool accepts_counts() const { return false; }
  /// Whether an output that nothing reads may have no memory: a null tensor at the launch.
  virtual bool skips_unread() const { return false; }
  /// Floating-point operations of one run, for plans and benchmarks.
  virtual double flops(const TensorTypes& /*in*/, const TensorTypes& /*out*/) const { return 0; }
};

}  // namespace vivant
