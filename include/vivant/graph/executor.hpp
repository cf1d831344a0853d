#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "vivant/graph/graph.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

struct ExecutorOptions {
  Precision precision = Precision::single;
  /// Every value in a buffer of its own, never shared: for memory checkers.
  bool separate_buffers = false;
  /// Bytes of a known pattern before and after every value, checked by `check_guards`; needs separate
  /// buffers.
  std::size_t guard_bytes = 0;
  /// Largest slab of the arena, at most what the device allows.
  std::size_t slab_bytes = std::size_t{1} << 30;
};

/// Runs a Graph again and again: plans memory by lifetime, builds the kernels and binds their arguments once,
/// then only enqueues. Nothing is allocated, compiled or waited for inside `run`.
class Executor {
 public:
  /// Plans what `outputs` and the graph's effects (assignments, optimizer) need; the rest is left out.
  /// `outputs` can be read after each run. The device, the graph and what external values point to must
  /// outlive the executor.
  Executor(Device& device, Graph& graph, const Values& outputs, ExecutorOptions options = {});
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  /// Sets a small input of 1, 2, 4, 8 or 16 numbers without waiting for the device.
  void set(Value scalar, double number);
  void set(Value input, std::span<const double> numbers);
  /// Writes an input or a value in external memory. Real tensors take float or double, whatever the
  /// precision.
  void write(Value input, std::span<const float> data);
  void write(Value input, std::span<const double> data);
  void write(Value input, std::span<const std::int32_t> data);
  void write(Value input, std::span<const std::uint8_t> data);

  /// Enqueues one run; returns at once.
  void run();
  /// Runs node by node and throws an Error that names the first op whose output holds a NaN or an infinity.
  void run_checked();

  /// Wait for the device and read an output, an input or an external value.
  std::vector<float> read(Value value);
  std::vector<double> read_doubles(Value value);
  std::vector<std::int32_t> read_ints(Value value);
  std::vector<std::uint8_t> read_bytes(Value value);

  /// Throws when a kernel wrote outside of its tensors; names the tensor's producer.
  void check_guards();
  /// Overwrites every value of the arena, so that a run which reads stale memory shows.
  void scramble(std::uint8_t byte);

  /// Bytes of the arena, and the lower bound for it: the most that is alive at one time.
  std::size_t arena_bytes() const;
  std::size_t lower_bound_bytes() const;
  double flops() const;
  std::size_t launches() const;
  /// The ops in order with shapes, bytes and FLOPs, as a table.
  std::string plan() const;
  /// The graph in the dot language.
  std::string dot() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vivant
