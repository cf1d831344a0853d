#pragma once
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vivant/graph/op.hpp"
#include "vivant/graph/types.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// A tensor of a Graph: a light handle. A default-constructed Value stands for an absent one (an optional
/// input).
struct Value {
  Graph* graph = nullptr;
  int id = -1;

  explicit operator bool() const { return graph != nullptr; }
  bool operator==(const Value&) const = default;
  /// Type and shape stay where they are while the graph lives.
  const TensorType& type() const;
  const Shape& shape() const { return type().shape; }
  DType dtype() const { return type().dtype; }
  std::int64_t elements() const { return shape().elements(); }
  /// The device-side count of leading rows that are alive; absent when all are.
  Value count() const;
};

/// Where a value lives when the executor does not place it in its arena: a range of a caller's buffer.
struct MemoryRange {
  std::shared_ptr<const Buffer> buffer;
  std::size_t offset = 0;  ///< bytes, a multiple of Device::alignment()
};

/// Records operations on tensors: define, then run. Functions such as `linear(x, w, b)` add a node and return
/// its value; `differentiate` adds the gradient nodes; Executor runs the result again and again.
class Graph {
 public:
  enum class Storage { arena, input, constant, external, alias };
  struct ValueRecord {
    TensorType type;
    std::string name;
    Storage storage = Storage::arena;
    MemoryRange placement;                 // external
    int alias_of = -1;                     // alias: shares the memory of this value
    std::vector<unsigned char> host_data;  // constant: as i32 or u8, or double for real
    int producer = -1;                     // node
  };
  struct Node {
    std::shared_ptr<const Op> op;
    Values inputs, outputs;
    bool effect = false;  // writes state: kept even when nothing reads its outputs
    std::string scope;
  };

  Graph() = default;
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  /// A tensor that the host writes between runs (Executor::write). Keeps its content from run to run.
  Value input(const std::string& name, Shape shape, DType dtype = DType::real);
  /// A number that the host sets between runs (Executor::set).
  Value scalar(const std::string& name, DType dtype = DType::real) { return input(name, {1}, dtype); }
  Value constant(Shape shape, std::span<const double> data);
  Value constant(Shape shape, std::span<const float> data);
  Value constant(Shape shape, std::span<const std::int32_t> data);
  Value zeros(const TensorType& type);
  /// A tensor in memory that the caller owns: parameters, images on the device, running statistics, caches.
  Value external(const std::string& name, TensorType type, MemoryRange placement);

  /// The same elements under another shape; costs nothing.
  Value reshape(Value x, Shape shape);
  /// `x` with a device-side count of live rows (i32 [1]), or without one when `count` is absent.
  Value with_count(Value x, Value count);
  /// The same value, of which gradients know nothing.
  Value detach(Value x);
  /// Copies `source` into `target`, an external or input value, when the graph runs.
  void assign(Value target, Value source);
  /// Makes an arena value live in the caller's memory, so that it outlives the run.
  void place(Value x, MemoryRange placement);

  /// Records an op; checks its inputs by Op::infer. Every node added while a Scope lives carries its name.
  Values record(std::shared_ptr<const Op> op, Values inputs, bool effect = false);
  template <typename O>
  Value record_one(O op, Values inputs) {
    return record(std::make_shared<O>(std::move(op)), std::move(inputs)).front();
  }

  /// What `make` records for `x`, made once per graph, value and `what`: packed weights, for example.
  Value memoised(Value x, const std::string& what, const std::function<Value()>& make);

  /// What `make` records under `name`, made once per graph: parameters, for example.
  Value named(const std::string& name, const std::function<Value()>& make);

  const std::deque<ValueRecord>& values() const { return values_; }
  const std::deque<Node>& nodes() const { return nodes_; }
  Value value(int id) { return {this, id}; }
  /// The value whose memory `id` uses: itself, or what it is an alias of.
  int root(int id) const;

  /// A name for the nodes recorded while it lives, for plans, drawings and error messages.
  class Scope {
   public:
    Scope(Graph& graph, const std::string& name);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Graph& graph_;
    std::string before_;
  };

 private:
  Value add(ValueRecord record);
  Value alias(Value x, TensorType type, std::shared_ptr<const Op> op);

  // References into them stay valid while nodes are added.
  std::deque<ValueRecord> values_;
  std::deque<Node> nodes_;
  std::map<std::pair<int, std::string>, Value> memoised_;
  std::string scope_;
};

/// Adds the nodes that compute d(sum_k outputs_k . seeds_k) / d wrt_i and returns one value per wrt, zeros
/// where there is no path. Nothing upstream of `wrt` is touched: values that are not asked for cost nothing.
Values differentiate(Graph& graph, const Values& outputs, const Values& seeds, const Values& wrt);
/// The same for a scalar loss [1], with the seed 1.
Values differentiate(Graph& graph, Value loss, const Values& wrt);

}  // namespace vivant
