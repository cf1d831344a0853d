#include "vivant/graph/executor.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "graph/executor_state.hpp"

namespace vivant {
namespace {

constexpr std::uint8_t guard_byte = 0xC5;

}  // namespace

Executor::Executor(Device& device, Graph& graph, const Values& outputs, ExecutorOptions options)
    : state_(std::make_unique<State>(device, graph, options)) {
  state_->select_nodes(outputs);
  state_->place_values(outputs);
  state_->upload_constants();
  state_->prepare_commands();
}

Executor::~Executor() {
  // The queue may still use our buffers and kernels; a failed run has been reported already.
  if (state_) clFinish(state_->device.queue());
}

void Executor::set(Value input, std::span<const double> numbers) {
  if (input.elements() != static_cast<std::int64_t>(numbers.size()))
    fail("[set] {} takes {} numbers, not {}", input.shape().text(), input.elements(), numbers.size());
  std::vector<std::uint8_t> pattern;
  const auto append = [&](auto number) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&number);
    pattern.insert(pattern.end(), bytes, bytes + sizeof(number));
  };
  for (const double number : numbers) {
    if (input.dtype() == DType::i32)
      append(static_cast<cl_int>(number));
    else if (state_->options.precision == Precision::double_)
      append(number);
    else
      append(static_cast<cl_float>(number));
  }
  // The driver copies a fill's pattern at once, so that nothing here has to wait or outlive the call.
  if (pattern.size() > 128 || (pattern.size() & (pattern.size() - 1)) != 0)
    fail("[set] {} numbers cannot be set at once: 1, 2, 4, 8 or 16 can", numbers.size());
  check(clEnqueueFillBuffer(state_->device.queue(), state_->memory_of(input.id).get(), pattern.data(),
                            pattern.size(), 0, pattern.size(), 0, nullptr, nullptr),
        "clEnqueueFillBuffer");
}

void Executor::set(Value scalar, double number) { set(scalar, std::span<const double>(&number, 1)); }

namespace {

void check_write(Value value, DType dtype, std::size_t elements) {
  const Graph::ValueRecord& record = value.graph->values()[value.graph->root(value.id)];
  if (record.storage != Graph::Storage::input && record.storage != Graph::Storage::external)
    fail("[write] {} {} is computed by the graph", record.name, value.shape().text());
  if (value.dtype() != dtype)
    fail("[write] the tensor is {}, the data {}", name_of(value.dtype()), name_of(dtype));
  if (value.elements() != static_cast<std::int64_t>(elements))
    fail("[write] the tensor {} takes {} elements, not {}", value.shape().text(), value.elements(), elements);
}

}  // namespace

void Executor::write(Value input, std::span<const double> data) {
  check_write(input, DType::real, data.size());
  if (state_->options.precision == Precision::double_)
    return state_->device.write(state_->memory_of(input.id), data.data(), data.size_bytes());
  const std::vector<float> narrow(data.begin(), data.end());
  state_->device.write(state_->memory_of(input.id), narrow.data(), narrow.size() * sizeof(float));
}

void Executor::write(Value input, std::span<const float> data) {
  check_write(input, DType::real, data.size());
  if (state_->options.precision == Precision::single)
    return state_->device.write(state_->memory_of(input.id), data.data(), data.size_bytes());
  const std::vector<double> wide(data.begin(), data.end());
  state_->device.write(state_->memory_of(input.id), wide.data(), wide.size() * sizeof(double));
}

void Executor::write(Value input, std::span<const std::int32_t> data) {
  check_write(input, DType::i32, data.size());
  state_->device.write(state_->memory_of(input.id), data.data(), data.size_bytes());
}

void Executor::write(Value input, std::span<const std::uint8_t> data) {
  check_write(input, DType::u8, data.size());
  state_->device.write(state_->memory_of(input.id), data.data(), data.size_bytes());
}

void Executor::run() {
  for (const Command& command : state_->commands) state_->enqueue(command);
  check(clFlush(state_->device.queue()), "clFlush");
}

void Executor::run_checked() {
  for (const State::PlannedNode& planned : state_->nodes) {
    for (std::size_t c = planned.first_command; c < planned.end_command; ++c)
      state_->enqueue(state_->commands[c]);
    const Graph::Node& node = state_->graph.nodes()[planned.node];
    for (const Value& out : node.outputs) {
      if (out.dtype() != DType::real || state_->graph.values()[out.id].storage == Graph::Storage::alias ||
          state_->skipped(node, out))
        continue;
      std::vector<double> data = state_->fetch_doubles(out);
      if (const Value count = out.count()) {
        const std::int64_t row = out.elements() / out.shape()[0];
        std::int32_t live = 0;
        state_->device.read(state_->memory_of(count.id), &live, sizeof(live));
        data.resize(std::min<std::size_t>(data.size(), live * row));
      }
      const auto bad = std::find_if(data.begin(), data.end(), [](double x) { return !std::isfinite(x); });
      if (bad != data.end())
        fail("the output of {} {} is not finite at element {}", state_->describe(node), out.shape().text(),
             bad - data.begin());
    }
  }
}

std::vector<double> Executor::read_doubles(Value value) {
  state_->check_readable(value);
  return state_->fetch_doubles(value);
}

std::vector<double> Executor::State::fetch_doubles(Value value) const {
  std::vector<double> data(value.elements());
  if (options.precision == Precision::double_) {
    device.read(memory_of(value.id), data.data(), data.size() * sizeof(double));
    return data;
  }
  std::vector<float> narrow(value.elements());
  device.read(memory_of(value.id), narrow.data(), narrow.size() * sizeof(float));
  return {narrow.begin(), narrow.end()};
}

std::vector<float> Executor::read(Value value) {
  if (value.dtype() != DType::real) fail("[read] the tensor is {}", name_of(value.dtype()));
  if (state_->options.precision == Precision::double_) {
    const std::vector<double> wide = read_doubles(value);
    return {wide.begin(), wide.end()};
  }
  state_->check_readable(value);
  std::vector<float> data(value.elements());
  state_->device.read(state_->memory_of(value.id), data.data(), data.size() * sizeof(float));
  return data;
}

std::vector<std::int32_t> Executor::read_ints(Value value) {
  if (value.dtype() != DType::i32) fail("[read] the tensor is {}", name_of(value.dtype()));
  state_->check_readable(value);
  std::vector<std::int32_t> data(value.elements());
  state_->device.read(state_->memory_of(value.id), data.data(), data.size() * sizeof(std::int32_t));
  return data;
}

std::vector<std::uint8_t> Executor::read_bytes(Value value) {
  state_->check_readable(value);
  std::vector<std::uint8_t> data(state_->bytes_of(value.type()));
  state_->device.read(state_->memory_of(value.id), data.data(), data.size());
  return data;
}

void Executor::check_guards() {
  const std::size_t guard = state_->options.guard_bytes;
  for (const State::Guarded& value : state_->guarded) {
    std::vector<std::uint8_t> bytes(value.whole.bytes());
    state_->device.read(value.whole, bytes.data(), bytes.size());
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const bool inside = i >= guard && i < guard + value.bytes;
      if (!inside && bytes[i] != guard_byte)
        fail("a kernel wrote {} bytes {} the memory of {}",
             i < guard ? guard - i : i - guard - value.bytes + 1, i < guard ? "before" : "behind",
             value.owner);
    }
  }
}

void Executor::scramble(std::uint8_t byte) {
  for (const Buffer& slab : state_->slabs) state_->device.fill(slab, byte);
  for (auto& [id, buffer] : state_->memory)
    if (state_->graph.values()[id].storage == Graph::Storage::arena) state_->device.fill(buffer, byte);
  for (auto& buffers : state_->scratch)
    for (const Buffer& buffer : buffers) state_->device.fill(buffer, byte);
}

std::size_t Executor::arena_bytes() const { return state_->arena; }
std::size_t Executor::lower_bound_bytes() const { return state_->lower_bound; }
std::size_t Executor::launches() const { return state_->commands.size(); }

double Executor::flops() const {
  double sum = 0;
  for (const State::PlannedNode& node : state_->nodes) sum += node.flops;
  return sum;
}

std::string Executor::plan() const {
  std::string text = fmt::format("{:>5}  {:<60} {:<28} {:>10} {:>10} {:>9}\n", "node", "op", "shape", "KiB",
                                 "MFLOP", "launches");
  for (const State::PlannedNode& planned : state_->nodes) {
    const Graph::Node& node = state_->graph.nodes()[planned.node];
    std::string shapes;
    std::size_t bytes = 0;
    for (const Value& out : node.outputs) {
      shapes += (shapes.empty() ? "" : " ") + out.shape().text();
      if (state_->graph.values()[out.id].storage != Graph::Storage::alias && !state_->skipped(node, out))
        bytes += state_->bytes_of(out.type());
    }
    text += fmt::format("{:>5}  {:<60} {:<28} {:>10.1f} {:>10.2f} {:>9}\n", planned.node,
                        state_->describe(node), shapes, static_cast<double>(bytes) / 1024,
                        planned.flops * 1e-6, planned.end_command - planned.first_command);
  }
  text += fmt::format("arena {:.1f} MiB (lower bound {:.1f} MiB), {:.3f} GFLOP, {} launches\n",
                      static_cast<double>(arena_bytes()) / (1 << 20),
                      static_cast<double>(lower_bound_bytes()) / (1 << 20), flops() * 1e-9, launches());
  return text;
}

std::string Executor::dot() const {
  std::string text = "digraph vivant {\n  node [shape=box, fontname=\"sans\"];\n";
  for (const State::PlannedNode& planned : state_->nodes) {
    const Graph::Node& node = state_->graph.nodes()[planned.node];
    std::string shapes;
    for (const Value& out : node.outputs) shapes += "\\n" + out.shape().text();
    text += fmt::format("  n{} [label=\"{}{}\"];\n", planned.node, state_->describe(node), shapes);
    for (const Value& in : node.inputs) {
      if (!in) continue;
      const Graph::ValueRecord& record = state_->graph.values()[in.id];
      if (record.producer >= 0) {
        text += fmt::format("  n{} -> n{};\n", record.producer, planned.node);
      } else if (record.storage != Graph::Storage::constant) {
        text += fmt::format("  v{} [label=\"{}\\n{}\", shape=ellipse];\n  v{} -> n{};\n", in.id, record.name,
                            in.shape().text(), in.id, planned.node);
      }
    }
  }
  return text + "}\n";
}

// ---- planning ----

void Executor::State::select_nodes(const Values& outputs) {
  value_needed.assign(graph.values().size(), false);
  const auto need = [&](int id) {
    value_needed[id] = true;
    value_needed[graph.root(id)] = true;
    if (graph.values()[id].type.count >= 0) value_needed[graph.values()[id].type.count] = true;
  };
  for (const Value& output : outputs) need(output.id);
  for (int n = static_cast<int>(graph.nodes().size()); n-- > 0;) {
    const Graph::Node& node = graph.nodes()[n];
    const bool wanted = node.effect || std::any_of(node.outputs.begin(), node.outputs.end(),
                                                   [&](const Value& out) { return value_needed[out.id]; });
    if (!wanted) continue;
    for (const Value& value : node.inputs)
      if (value) need(value.id);
    for (const Value& value : node.outputs)
      if (value.type().count >= 0) value_needed[value.type().count] = true;
    nodes.push_back({.node = n});
  }
  std::reverse(nodes.begin(), nodes.end());
}

const Buffer& Executor::State::memory_of(int value) const {
  const auto found = memory.find(graph.root(value));
  if (found == memory.end())
    fail("the value {} of this graph is not an output of this executor", graph.values()[value].name);
  return found->second;
}

void Executor::State::check_readable(Value value) const {
  const Graph::ValueRecord& record = graph.values()[graph.root(value.id)];
  if (record.storage == Graph::Storage::arena && !readable.contains(graph.root(value.id)))
    fail("the value {} {} is not an output of this executor: other values may have its memory", record.name,
         value.shape().text());
}

Tensor Executor::State::tensor_of(int value) const {
  return {graph.values()[value].type, memory_of(value).get()};
}

std::string Executor::State::describe(const Graph::Node& node) const {
  return node.scope.empty() ? std::string(node.op->name()) : node.scope + "/" + std::string(node.op->name());
}

void Executor::State::enqueue(const Command& command) {
  if (command.kernel) return device.launch(command.kernel, command.name, command.global, command.local);
  cl_event event = nullptr;
  cl_event* wanted = device.profiler().enabled() ? &event : nullptr;
  if (command.source) {
    check(clEnqueueCopyBuffer(device.queue(), command.source, command.target, 0, 0, command.bytes, 0, nullptr,
                              wanted),
          "clEnqueueCopyBuffer");
  } else {
    const cl_uchar zero = 0;
    check(clEnqueueFillBuffer(device.queue(), command.target, &zero, 1, 0, command.bytes, 0, nullptr, wanted),
          "clEnqueueFillBuffer");
  }
  if (event) device.profiler().record(command.name, event);
}

void Executor::State::upload_constants() {
  for (std::size_t id = 0; id < graph.values().size(); ++id) {
    const Graph::ValueRecord& record = graph.values()[id];
    if (record.storage != Graph::Storage::constant || !value_needed[id]) continue;
    if (record.type.dtype == DType::real && options.precision == Precision::single) {
      std::vector<float> narrow(record.type.shape.elements());
      for (std::size_t i = 0; i < narrow.size(); ++i) {
        double wide;
        std::memcpy(&wide, record.host_data.data() + i * sizeof(double), sizeof(double));
        narrow[i] = static_cast<float>(wide);
      }
      device.write(memory_of(static_cast<int>(id)), narrow.data(), narrow.size() * sizeof(float));
    } else {
      device.write(memory_of(static_cast<int>(id)), record.host_data.data(), record.host_data.size());
    }
  }
}

void Executor::State::prepare_commands() {
  for (std::size_t p = 0; p < nodes.size(); ++p) {
    const Graph::Node& node = graph.nodes()[nodes[p].node];
    nodes[p].first_command = commands.size();
    Launch launch(device, options.precision, commands);
    TensorTypes in_types, out_types;
    const auto add_count = [&](const TensorType& type) {
      if (type.count >= 0) launch.counts.emplace_back(type.count, tensor_of(type.count));
    };
    for (const Value& in : node.inputs) {
      launch.inputs.push_back(in ? tensor_of(in.id) : Tensor{});
      in_types.push_back(in ? in.type() : TensorType{});
      add_count(in_types.back());
    }
    for (const Value& out : node.outputs) {
      launch.outputs.push_back(skipped(node, out) ? Tensor{out.type()} : tensor_of(out.id));
      out_types.push_back(out.type());
      add_count(out_types.back());
    }
    const TensorTypes workspaces = node.op->workspaces(in_types);
    for (std::size_t w = 0; w < workspaces.size(); ++w)
      launch.scratch.push_back({workspaces[w], scratch[p][w].get()});
    node.op->launch(launch);
    nodes[p].end_command = commands.size();
    nodes[p].flops = node.op->flops(in_types, out_types);
  }
}

Buffer Executor::State::separate(std::size_t bytes, const std::string& owner) {
  arena += bytes;
  if (options.guard_bytes == 0) return device.allocate(bytes);
  const std::size_t guard = options.guard_bytes;
  Guarded value{device.allocate(bytes + 2 * guard), bytes, owner};
  device.fill(value.whole, guard_byte);
  Buffer inside = device.view(value.whole, guard, bytes);
  guarded.push_back(std::move(value));
  return inside;
}

}  // namespace vivant
