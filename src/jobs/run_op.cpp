#include "vivant/jobs/run_op.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "vivant/graph/executor.hpp"

namespace vivant {

using nlohmann::json;

namespace {

json describe_ports(const std::vector<Port>& ports) {
  json list = json::array();
  for (const Port& port : ports)
    list.push_back({{"name", port.name},
                    {"shape", port.shape},
                    {"dtype", name_of(port.dtype)},
                    {"optional", port.optional}});
  return list;
}

bool is_floating(ElementType type) {
  return type == ElementType::f64 || type == ElementType::f32 || type == ElementType::f16 ||
         type == ElementType::bf16;
}

/// The number of dimensions that "[rays, samples, C]" asks for; -1 for "[..., C]" and alternatives.
int rank_of(const std::string& shape) {
  const bool plain = shape.size() > 2 && shape.front() == '[' && shape.find(']') == shape.size() - 1 &&
                     shape.find("...") == std::string::npos;
  return plain ? 1 + static_cast<int>(std::count(shape.begin(), shape.end(), ',')) : -1;
}

void check_input(const OpInfo& info, const Port& port, const TensorFile& file, const HostTensor& tensor) {
  const bool fits = port.dtype == DType::real  ? is_floating(tensor.type)
                    : port.dtype == DType::i32 ? !is_floating(tensor.type)
                                               : tensor.type == ElementType::u8;
  if (!fits)
    fail("{}: [{}] input {} must be {} {}, the file has {}", file.source, info.name, port.name,
         name_of(port.dtype), port.shape, tensor.describe());
  const int rank = rank_of(port.shape);
  if (tensor.element_count() == 0 || (rank >= 0 && rank != static_cast<int>(tensor.shape.size())))
    fail("{}: [{}] input {} must have the shape {}, the file has {}", file.source, info.name, port.name,
         port.shape, tensor.describe());
}

void check_names(const OpInfo& info, const TensorFile& file) {
  std::vector<std::string> known;
  for (const Port& port : info.inputs) known.push_back(port.name);
  for (const Port& port : info.outputs) known.push_back("grad_" + port.name);
  for (const auto& [name, tensor] : file.tensors)
    if (std::find(known.begin(), known.end(), name) == known.end())
      fail("{}: [{}] does not know the tensor '{}': it takes {}", file.source, info.name, name,
           fmt::join(known, ", "));
}

void write(Executor& executor, Value value, const HostTensor& tensor) {
  if (value.dtype() == DType::real) return executor.write(value, std::span<const float>(tensor.as_floats()));
  std::vector<std::int32_t> ints;
  std::vector<std::uint8_t> bytes;
  for (std::int64_t number : tensor.as_ints()) {
    if (number != static_cast<std::int32_t>(number)) fail("{} does not fit into 32 bits", number);
    ints.push_back(static_cast<std::int32_t>(number));
    bytes.push_back(static_cast<std::uint8_t>(number));
  }
  if (value.dtype() == DType::i32) return executor.write(value, std::span<const std::int32_t>(ints));
  executor.write(value, std::span<const std::uint8_t>(bytes));
}

HostTensor read(Executor& executor, Value value) {
  const std::vector<std::int64_t>& shape = value.shape().extents();
  if (value.dtype() == DType::real) return {shape, std::span<const float>(executor.read(value))};
  if (value.dtype() == DType::i32) return {shape, std::span<const std::int32_t>(executor.read_ints(value))};
  return {shape, std::span<const std::uint8_t>(executor.read_bytes(value))};
}

/// An op with its inputs and, when asked for, its gradients, in a graph of its own.
struct SingleOp {
  SingleOp(const OpInfo& info, const json& attributes, const TensorFile& file) : info(info), file(file) {
    for (const Port& port : info.inputs) {
      in.emplace_back();
      if (!file.contains(port.name)) {
        if (!port.optional) file.at(port.name);  // throws: names what is there
        continue;
      }
      const HostTensor& tensor = file.at(port.name);
      check_input(info, port, file, tensor);
      const Shape shape = tensor.shape.empty() ? Shape{1} : Shape(tensor.shape);
      in.back() = graph.input(port.name, shape, port.dtype);
      given.emplace_back(in.back(), &tensor);
    }
    out = info.build(graph, in, info.complete(attributes));
    for (std::size_t k = 0; k < out.size(); ++k) results.emplace_back(info.outputs.at(k).name, out[k]);
  }

  void add_gradients() {
    Values outputs, seeds, wrt;
    for (std::size_t k = 0; k < out.size(); ++k) {
      const std::string name = "grad_" + info.outputs[k].name;
      if (out[k].dtype() != DType::real || !file.contains(name)) continue;
      const HostTensor& seed = file.at(name, out[k].shape().extents());
      outputs.push_back(out[k]);
      seeds.push_back(graph.input(name, out[k].shape()));
      given.emplace_back(seeds.back(), &seed);
    }
    if (outputs.empty())
      fail("{}: gradients need grad_{}, the gradient of the output", file.source, info.outputs.front().name);
    std::vector<std::string> names;
    for (std::size_t i = 0; i < in.size(); ++i) {
      if (!in[i] || in[i].dtype() != DType::real) continue;
      wrt.push_back(in[i]);
      names.push_back("grad_" + info.inputs[i].name);
    }
    const Values grads = differentiate(graph, outputs, seeds, wrt);
    for (std::size_t i = 0; i < grads.size(); ++i) results.emplace_back(names[i], grads[i]);
  }

  const OpInfo& info;
  const TensorFile& file;
  Graph graph;
  Values in, out;
  std::vector<std::pair<Value, const HostTensor*>> given;
  std::vector<std::pair<std::string, Value>> results;
};

}  // namespace

json describe_op(const OpInfo& info) {
  json attributes = json::array();
  for (const AttributeInfo& attribute : info.attributes)
    attributes.push_back({{"name", attribute.name},
                          {"type", attribute.standard.type_name()},
                          {"default", attribute.standard},
                          {"summary", attribute.summary}});
  return {{"name", info.name},
          {"summary", info.summary},
          {"inputs", describe_ports(info.inputs)},
          {"outputs", describe_ports(info.outputs)},
          {"attributes", attributes}};
}

json parse_attributes(const OpInfo& info, const std::vector<std::string>& settings) {
  json values = json::object();
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos)
      throw UsageError(fmt::format("--attr takes name=value, not '{}'", setting));
    const std::string name = setting.substr(0, equals), text = setting.substr(equals + 1);
    const bool is_text = std::any_of(info.attributes.begin(), info.attributes.end(), [&](const auto& known) {
      return known.name == name && known.standard.is_string();
    });
    json value = is_text ? json(text) : json::parse(text, nullptr, false);
    if (value.is_discarded()) value = text;  // refused below, with the attribute's type
    values[name] = std::move(value);
  }
  info.complete(values);
  return values;
}

TensorFile run_op(Device& device, const OpInfo& info, const json& attributes, const TensorFile& in,
                  bool gradients) {
  check_names(info, in);
  SingleOp op(info, attributes, in);
  if (gradients) op.add_gradients();
  Values kept;
  for (const auto& [name, value] : op.results) kept.push_back(value);
  Executor executor(device, op.graph, kept);
  for (const auto& [value, tensor] : op.given) write(executor, value, *tensor);
  executor.run();
  TensorFile result;
  for (const auto& [name, value] : op.results) result.tensors.emplace(name, read(executor, value));
  return result;
}

}  // namespace vivant
