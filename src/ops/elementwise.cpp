#include "vivant/ops/elementwise.hpp"

#include "ops/rows.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::string_view activation_names[] = {"none",     "relu",    "leaky_relu",
                                                 "softplus", "sigmoid", "truncated_exp"};

struct Activate final : Op {
  explicit Activate(Activation activation) : activation(activation) {}
  std::string_view name() const override { return "activation"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("elementwise.cl", "activation", {{"ACTIVATION", static_cast<int>(activation)}})
        .args(x, launch.out(), x.rows(), x.channels(), launch.count_of(x))
        .run(vectors(launch, x.elements()), vector_group());
  }
  Values gradient(const GradientRequest& request) const override {
    return {activation_gradient(request.out[0], request.grad(), activation)};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
  const Activation activation;
};

struct ActivationGradient final : Op {
  explicit ActivationGradient(Activation activation) : activation(activation) {}
  std::string_view name() const override { return "activation_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape != in[1].shape)
      fail("[activation_gradient] y is {}, its gradient {}", in[0].shape.text(), in[1].shape.text());
    return {in[0]};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& y = launch.in(0);
    launch.kernel("elementwise.cl", "activation_gradient", {{"ACTIVATION", static_cast<int>(activation)}})
        .args(y, launch.in(1), launch.out(), y.rows(), y.channels(), launch.count_of(y))
        .run(vectors(launch, y.elements()), vector_group());
  }
  const Activation activation;
};

struct Affine final : Op {
  Affine(double scale, double shift) : scale(scale), shift(shift) {}
  std::string_view name() const override { return "affine"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("elementwise.cl", "affine")
        .args(x, launch.out(), scale, shift, x.rows(), x.channels(), launch.count_of(x))
        .run(vectors(launch, x.elements()), vector_group());
  }
  Values gradient(const GradientRequest& request) const override { return {affine(request.grad(), scale)}; }
  const double scale, shift;
};

/// Inputs: x, grad_y.
struct ClampGradient final : Op {
  ClampGradient(double low, double high) : low(low), high(high) {}
  std::string_view name() const override { return "clamp_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("elementwise.cl", "clamp_gradient")
        .args(x, launch.in(1), launch.out(), low, high, x.rows(), x.channels(), launch.count_of(x))
        .run(vectors(launch, x.elements()), vector_group());
  }
  const double low, high;
};

struct Clamp final : Op {
  Clamp(double low, double high) : low(low), high(high) {}
  std::string_view name() const override { return "clamp"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (!(low <= high)) fail("[clamp] the range {} to {} is empty", low, high);
    return {in[0]};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("elementwise.cl", "clamp_range")
        .args(x, launch.out(), low, high, x.rows(), x.channels(), launch.count_of(x))
        .run(vectors(launch, x.elements()), vector_group());
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(ClampGradient(low, high), {request.in[0], request.grad()})};
  }
  const double low, high;
};

enum class Broadcast { none, row, channels, single };

Broadcast broadcast_of(std::string_view name, const Shape& a, const Shape& b) {
  if (a == b) return Broadcast::none;
  if (b.elements() == 1) return Broadcast::single;
  if (b.rank() == 1 && b.channels() == a.channels()) return Broadcast::row;
  if (b.channels() == 1 && b.elements() == a.rows()) return Broadcast::channels;
  fail("[{}] {} does not broadcast over {}", name, b.text(), a.text());
}

Value reduce_to(Value gradient, Broadcast broadcast, const Shape& shape) {
  Graph& graph = *gradient.graph;
  switch (broadcast) {
    case Broadcast::none:
      return gradient;
    case Broadcast::row:
      return graph.reshape(sum_rows(gradient), shape);
    case Broadcast::channels:
      return graph.reshape(sum_channels(gradient), shape);
    case Broadcast::single:
      return graph.reshape(sum(gradient), shape);
  }
  return {};
}

struct Binary final : Op {
  explicit Binary(char operation) : operation(operation) {}
  std::string_view name() const override {
    return operation == '+' ? "add" : operation == '-' ? "subtract" : "multiply";
  }
  TensorTypes infer(const TensorTypes& in) const override {
    broadcast_of(name(), in[0].shape, in[1].shape);
    return {in[0]};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& a = launch.in(0);
    const Broadcast broadcast = broadcast_of(name(), a.shape(), launch.in(1).shape());
    launch
        .kernel("elementwise.cl", "binary",
                {{"OPERATION", std::string(1, operation)}, {"BROADCAST", static_cast<int>(broadcast)}})
        .args(a, launch.in(1), launch.out(), a.rows(), a.channels(), launch.count_of(a))
        .run(vectors(launch, a.elements()), vector_group());
  }
  Values gradient(const GradientRequest& request) const override {
    const Value grad = request.grad(), a = request.in[0], b = request.in[1];
    Value grad_a, grad_b;
    if (request.needed[0]) grad_a = operation == '*' ? multiply(grad, b) : grad;
    if (request.needed[1]) {
      grad_b = operation == '*' ? multiply(grad, a) : operation == '-' ? affine(grad, -1) : grad;
      grad_b = reduce_to(grad_b, broadcast_of(name(), a.shape(), b.shape()), b.shape());
    }
    return {grad_a, grad_b};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape.elements());
  }
  const char operation;
};

Value binary(char operation, Value a, Value b) { return a.graph->record_one(Binary(operation), {a, b}); }

const RegisterOp register_activation({
    .name = "activation",
    .summary = "y = f(x), element by element",
    .inputs = {{"x", "[..., C]"}},
    .outputs = {{"y", "[..., C]"}},
    .attributes = {{"function", "relu", "relu, leaky_relu, softplus, sigmoid or truncated_exp"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {activate(in[0], activation_from(a.text("function")))};
    },
});
const RegisterOp register_affine({
    .name = "affine",
    .summary = "y = scale * x + shift",
    .inputs = {{"x", "[..., C]"}},
    .outputs = {{"y", "[..., C]"}},
    .attributes = {{"scale", 1.0, "factor"}, {"shift", 0.0, "term"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {affine(in[0], a.number("scale"), a.number("shift"))};
    },
});

const RegisterOp register_clamp({
    .name = "clamp",
    .summary = "x held within [low, high]",
    .inputs = {{"x", "[..., C]"}},
    .outputs = {{"y", "[..., C]"}},
    .attributes = {{"low", 0.0, "least value"}, {"high", 1.0, "largest value"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {clamp(in[0], a.number("low"), a.number("high"))};
    },
});

OpInfo binary_info(const std::string& name, const std::string& summary, Value (*function)(Value, Value)) {
  return {.name = name,
          .summary = summary,
          .inputs = {{"a", "[..., C]"}, {"b", "[..., C], [C], [..., 1] or [1]"}},
          .outputs = {{"y", "[..., C]"}},
          .attributes = {},
          .build = [function](Graph&, const Values& in, const Attributes&) -> Values {
            return {function(in[0], in[1])};
          }};
}
const RegisterOp register_add(binary_info("add", "y = a + b, b broadcast over a", add));
const RegisterOp register_subtract(binary_info("subtract", "y = a - b, b broadcast over a", subtract));
const RegisterOp register_multiply(binary_info("multiply", "y = a * b, b broadcast over a", multiply));

}  // namespace

std::string_view name_of(Activation activation) { return activation_names[static_cast<int>(activation)]; }

Activation activation_from(const std::string& name) {
  for (int i = 0; i < static_cast<int>(std::size(activation_names)); ++i)
    if (activation_names[i] == name) return static_cast<Activation>(i);
  throw UsageError(fmt::format(
      "unknown activation '{}': use none, relu, leaky_relu, softplus, sigmoid or truncated_exp", name));
}

Value activate(Value x, Activation activation) {
  return activation == Activation::none ? x : x.graph->record_one(Activate(activation), {x});
}

Value activation_gradient(Value y, Value grad_y, Activation activation) {
  if (activation == Activation::none) return grad_y;
  return y.graph->record_one(ActivationGradient(activation), {y, grad_y});
}

Value affine(Value x, double scale, double shift) { return x.graph->record_one(Affine(scale, shift), {x}); }
Value clamp(Value x, double low, double high) { return x.graph->record_one(Clamp(low, high), {x}); }
Value add(Value a, Value b) { return binary('+', a, b); }
Value subtract(Value a, Value b) { return binary('-', a, b); }
Value multiply(Value a, Value b) { return binary('*', a, b); }

}  // namespace vivant
