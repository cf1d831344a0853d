#pragma once
#include <map>
#include <set>
#include <vector>

#include "vivant/graph/executor.hpp"
#include "vivant/graph/launch.hpp"

namespace vivant {

/// What an Executor keeps: the live nodes, the memory of every value, and the prepared commands.
struct Executor::State {
  struct PlannedNode {
    int node = 0;
    std::size_t first_command = 0, end_command = 0;
    double flops = 0;
  };
  struct Guarded {
    Buffer whole;  // guard, value, guard
    std::size_t bytes = 0;
    std::string owner;
  };

  State(Device& device, Graph& graph, ExecutorOptions options)
      : device(device), graph(graph), options(options) {}

  void select_nodes(const Values& outputs);
  void place_values(const Values& outputs);
  void upload_constants();
  void prepare_commands();
  void enqueue(const Command& command);

  const Buffer& memory_of(int value) const;
  void check_readable(Value value) const;
  std::vector<double> fetch_doubles(Value value) const;
  std::size_t bytes_of(const TensorType& type) const {
    return static_cast<std::size_t>(type.shape.elements()) * element_bytes(type.dtype, options.precision);
  }
  Tensor tensor_of(int value) const;
  /// Whether nothing reads this output, and its op can do without.
  bool skipped(const Graph::Node& node, const Value& out) const {
    return node.op->skips_unread() && !value_needed[out.id] && !value_needed[graph.root(out.id)];
  }
  std::string describe(const Graph::Node& node) const;

  Device& device;
  Graph& graph;
  ExecutorOptions options;
  std::vector<PlannedNode> nodes;
  std::vector<bool> value_needed;
  std::set<int> readable;  // roots of the outputs and of their counts
  std::vector<Buffer> slabs;
  std::map<int, Buffer> memory;              // by root value
  std::vector<std::vector<Buffer>> scratch;  // by planned node
  std::vector<Guarded> guarded;
  std::vector<Command> commands;
  std::size_t arena = 0, lower_bound = 0;

 private:
  Buffer separate(std::size_t bytes, const std::string& owner);
};

}  // namespace vivant
