#include "vivant/graph/graph.hpp"

#include <cstring>

#include "graph/basic_ops.hpp"

namespace vivant {
namespace {

template <typename T>
std::vector<unsigned char> bytes_of(std::span<const T> data) {
  std::vector<unsigned char> bytes(data.size_bytes());
  if (!bytes.empty()) std::memcpy(bytes.data(), data.data(), bytes.size());
  return bytes;
}

void check_elements(const Shape& shape, std::size_t elements) {
  if (shape.elements() != static_cast<std::int64_t>(elements))
    fail("[constant] shape {} holds {} elements, the data has {}", shape.text(), shape.elements(), elements);
}

}  // namespace

const TensorType& Value::type() const { return graph->values()[id].type; }

Value Value::count() const { return type().count < 0 ? Value{} : Value{graph, type().count}; }

Value GradientRequest::grad(int i) const {
  if (grad_out[i]) return grad_out[i];
  return graph.with_count(graph.zeros({DType::real, out[i].shape()}), out[i].count());
}

Values Op::gradient(const GradientRequest&) const { fail("[{}] has no gradient", name()); }

Value Graph::add(ValueRecord record) {
  for (std::int64_t extent : record.type.shape.extents())
    if (extent < 1) fail("[{}] a tensor of shape {} is empty", record.name, record.type.shape.text());
  values_.push_back(std::move(record));
  return {this, static_cast<int>(values_.size()) - 1};
}

Value Graph::input(const std::string& name, Shape shape, DType dtype) {
  ValueRecord record;
  record.type = {dtype, std::move(shape)};
  record.name = name;
  record.storage = Storage::input;
  return add(std::move(record));
}

Value Graph::constant(Shape shape, std::span<const double> data) {
  check_elements(shape, data.size());
  ValueRecord record;
  record.type = {DType::real, std::move(shape)};
  record.name = "constant";
  record.storage = Storage::constant;
  record.host_data = bytes_of(data);
  return add(std::move(record));
}

Value Graph::constant(Shape shape, std::span<const float> data) {
  const std::vector<double> wide(data.begin(), data.end());
  return constant(std::move(shape), std::span<const double>(wide));
}

Value Graph::constant(Shape shape, std::span<const std::int32_t> data) {
  check_elements(shape, data.size());
  ValueRecord record;
  record.type = {DType::i32, std::move(shape)};
  record.name = "constant";
  record.storage = Storage::constant;
  record.host_data = bytes_of(data);
  return add(std::move(record));
}

Value Graph::zeros(const TensorType& type) { return record_one(Zeros({type.dtype, type.shape}), {}); }

Value Graph::external(const std::string& name, TensorType type, MemoryRange placement) {
  ValueRecord record;
  record.type = std::move(type);
  record.name = name;
  record.storage = Storage::external;
  record.placement = std::move(placement);
  return add(std::move(record));
}

Value Graph::alias(Value x, TensorType type, std::shared_ptr<const Op> op) {
  const Value out = record(std::move(op), {x}).front();
  values_[out.id].storage = Storage::alias;
  values_[out.id].alias_of = root(x.id);
  values_[out.id].type = std::move(type);
  return out;
}

Value Graph::reshape(Value x, Shape shape) {
  if (shape == x.shape()) return x;
  TensorType type = x.type();
  if (type.count >= 0 && shape[0] != type.shape[0])
    fail("[reshape] {} has a count of rows: the first extent of {} must stay", x.shape().text(),
         shape.text());
  type.shape = shape;
  return alias(x, type, std::make_shared<Reshape>(std::move(shape)));
}

Value Graph::with_count(Value x, Value count) {
  TensorType type = x.type();
  if (type.count == (count ? count.id : -1)) return x;
  if (count && (count.dtype() != DType::i32 || count.elements() != 1))
    fail("[with_count] the count must be i32 [1], it is {} {}", name_of(count.dtype()), count.shape().text());
  if (x.shape().rank() != 2)
    fail("[with_count] only matrices [rows, channels] have counts, not {}", x.shape().text());
  type.count = count ? count.id : -1;
  return alias(x, type, std::make_shared<SetCount>());
}

Value Graph::detach(Value x) { return alias(x, x.type(), std::make_shared<Detach>()); }

void Graph::assign(Value target, Value source) { record(std::make_shared<Assign>(), {target, source}, true); }

void Graph::place(Value x, MemoryRange placement) {
  ValueRecord& record = values_[x.id];
  if (record.storage != Storage::arena) fail("[place] {} is not in the arena", record.name);
  record.storage = Storage::external;
  record.placement = std::move(placement);
}

Values Graph::record(std::shared_ptr<const Op> op, Values inputs, bool effect) {
  TensorTypes types;
  for (const Value& input : inputs) {
    if (input && input.graph != this) fail("[{}] an input belongs to another graph", op->name());
    types.push_back(input ? input.type() : TensorType{});
    if (input && input.type().count >= 0 && !op->accepts_counts())
      fail("[{}] does not take inputs with a device-side count of rows", op->name());
  }
  const TensorTypes out_types = op->infer(types);
  Node node;
  node.op = op;
  node.inputs = std::move(inputs);
  node.effect = effect;
  node.scope = scope_;
  for (const TensorType& type : out_types) {
    ValueRecord record;
    record.type = type;
    record.name = std::string(op->name());
    record.producer = static_cast<int>(nodes_.size());
    node.outputs.push_back(add(std::move(record)));
  }
  nodes_.push_back(node);
  return node.outputs;
}

Value Graph::memoised(Value x, const std::string& what, const std::function<Value()>& make) {
  const std::pair<int, std::string> key(x.id, what);  // id -1: no value
  const auto found = memoised_.find(key);
  return found != memoised_.end() ? found->second : memoised_.emplace(key, make()).first->second;
}

Value Graph::named(const std::string& name, const std::function<Value()>& make) {
  return memoised(Value{}, name, make);
}

int Graph::root(int id) const {
  while (values_[id].storage == Storage::alias) id = values_[id].alias_of;
  return id;
}

Graph::Scope::Scope(Graph& graph, const std::string& name) : graph_(graph), before_(graph.scope_) {
  graph_.scope_ = before_.empty() ? name : before_ + "/" + name;
}

Graph::Scope::~Scope() { graph_.scope_ = before_; }

}  // namespace vivant
