#include <algorithm>

#include "vivant/graph/graph.hpp"
#include "vivant/ops/elementwise.hpp"

namespace vivant {
namespace {

/// Which values depend on one of `wrt` through real-valued tensors.
std::vector<bool> dependents(const Graph& graph, const Values& wrt) {
  std::vector<bool> depends(graph.values().size(), false);
  for (const Value& value : wrt) depends[value.id] = true;
  for (const Graph::Node& node : graph.nodes()) {
    if (node.op->name() == "detach") continue;
    const bool any = std::any_of(node.inputs.begin(), node.inputs.end(), [&](const Value& in) {
      return in && in.dtype() == DType::real && depends[in.id];
    });
    for (const Value& out : node.outputs)
      if (any && out.dtype() == DType::real) depends[out.id] = true;
  }
  return depends;
}

}  // namespace

Values differentiate(Graph& graph, const Values& outputs, const Values& seeds, const Values& wrt) {
  const std::vector<bool> depends = dependents(graph, wrt);
  Values gradients(graph.values().size());  // summed over the uses of each value
  const auto accumulate = [&](int id, Value gradient) {
    gradients[id] = gradients[id] ? add(gradients[id], gradient) : gradient;
  };
  for (std::size_t k = 0; k < outputs.size(); ++k)
    if (depends[outputs[k].id]) accumulate(outputs[k].id, seeds[k]);
  for (std::size_t n = graph.nodes().size(); n-- > 0;) {
    const Graph::Node& node = graph.nodes()[n];
    Values grad_out;
    bool flows = false;
    for (const Value& out : node.outputs) {
      grad_out.push_back(gradients[out.id]);
      flows = flows || gradients[out.id];
    }
    std::vector<bool> needed;
    for (const Value& in : node.inputs) needed.push_back(in && in.dtype() == DType::real && depends[in.id]);
    if (!flows || std::find(needed.begin(), needed.end(), true) == needed.end()) continue;
    const Graph::Scope scope(graph, node.scope.empty() ? "gradient" : node.scope + "/gradient");
    const Values grads = node.op->gradient({graph, node.inputs, node.outputs, grad_out, needed});
    for (std::size_t i = 0; i < grads.size(); ++i) {
      if (!grads[i] || !needed[i]) continue;
      if (grads[i].shape() != node.inputs[i].shape())
        fail("[{}] the gradient of input {} has shape {}, the input {}", node.op->name(), i,
             grads[i].shape().text(), node.inputs[i].shape().text());
      accumulate(node.inputs[i].id, grads[i]);
    }
  }
  Values result;
  for (const Value& value : wrt)
    result.push_back(gradients[value.id] ? gradients[value.id] : graph.zeros({DType::real, value.shape()}));
  return result;
}

Values differentiate(Graph& graph, Value loss, const Values& wrt) {
  if (loss.elements() != 1)
    fail("[differentiate] the loss must have one element, its shape is {}", loss.shape().text());
  const std::vector<double> one = {1.0};
  const Value seed = graph.reshape(graph.constant({1}, std::span<const double>(one)), loss.shape());
  return differentiate(graph, {loss}, {seed}, wrt);
}

}  // namespace vivant
