// Convolutions, products and perceptrons in oneDNN: images and matrices channels last, weights beforehand in
// the layout that it prefers. `peer_onednn Winograd` asks for that algorithm.
#include <dnnl.hpp>
#include <unordered_map>

#include "peer_server.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant::peers {
namespace {

using dnnl::algorithm;
using dnnl::memory;
using dnnl::prop_kind;
using Tag = memory::format_tag;
using Type = memory::data_type;

algorithm convolution_algorithm = algorithm::convolution_direct;

/// Primitives that run one after the other, and what they compute.
class Sequence {
 public:
  explicit Sequence(const TensorFile& inputs, Type type) : inputs_(&inputs), type_(type) {}

  const dnnl::engine& engine() const { return engine_; }
  memory::desc plain(const memory::dims& dims, Tag tag) const { return {dims, type_, tag}; }
  memory::desc any(const memory::dims& dims) const { return {dims, type_, Tag::any}; }
  memory empty(const memory::desc& description) { return {description, engine_}; }
  /// The input `name`, which is laid out as `given` says, in the layout `wanted`.
  memory input(const std::string& name, const memory::dims& dims, Tag given, const memory::desc& wanted) {
    const std::vector<float> data = inputs_->at(name).as_floats();
    memory source({dims, Type::f32, given}, engine_);
    std::copy(data.begin(), data.end(), static_cast<float*>(source.get_data_handle()));
    return reordered(source, wanted);
  }
  void add(const dnnl::primitive& primitive, const std::unordered_map<int, memory>& arguments) {
    steps_.emplace_back(primitive, arguments);
  }
  void result(const std::string& name, const memory& value, const memory::dims& dims, Tag tag,
              std::vector<std::int64_t> shape) {
    results_.push_back({name, value, {dims, Type::f32, tag}, std::move(shape)});
  }

  void run() {
    for (const auto& [primitive, arguments] : steps_) primitive.execute(stream_, arguments);
    stream_.wait();
  }
  TensorFile results() {
    TensorFile file;
    for (const Result& result : results_) {
      const memory target = reordered(result.value, result.plain);
      const auto* data = static_cast<const float*>(target.get_data_handle());
      file.tensors[result.name] =
          HostTensor(result.shape, std::span<const float>(data, result.plain.get_size() / sizeof(float)));
    }
    return file;
  }

 private:
  struct Result {
    std::string name;
    memory value;
    memory::desc plain;
    std::vector<std::int64_t> shape;
  };
  memory reordered(memory source, const memory::desc& wanted) {
    if (source.get_desc() == wanted) return source;
    memory target(wanted, engine_);
    dnnl::reorder(source, target).execute(stream_, source, target);
    stream_.wait();
    return target;
  }

  const TensorFile* inputs_;
  Type type_;
  dnnl::engine engine_{dnnl::engine::kind::cpu, 0};
  dnnl::stream stream_{engine_};
  std::vector<std::pair<dnnl::primitive, std::unordered_map<int, memory>>> steps_;
  std::vector<Result> results_;
};

void convolution(Sequence& work, const nlohmann::json& request) {
  const std::int64_t height = request.at("height"), width = request.at("width"), in = request.at("in"),
                     out = request.at("out");
  const std::string part = request.at("part");
  const memory::dims x_dims = {1, in, height, width}, y_dims = {1, out, height, width},
                     w_dims = {out, in, 3, 3}, one = {1, 1};
  // Winograd knows layouts of its own alone: it may have them.
  const bool direct = convolution_algorithm == algorithm::convolution_direct;
  const memory::desc x_any = direct ? work.plain(x_dims, Tag::nhwc) : work.any(x_dims),
                     y_any = direct ? work.plain(y_dims, Tag::nhwc) : work.any(y_dims), w = work.any(w_dims);
  const dnnl::convolution_forward::primitive_desc forward(
      {prop_kind::forward_training, convolution_algorithm, x_any, w, y_any, one, one, one}, work.engine());
  if (part == "forward") {
    const memory result = work.empty(forward.dst_desc());
    work.add(dnnl::convolution_forward(forward),
             {{DNNL_ARG_SRC, work.input("x", x_dims, Tag::nhwc, forward.src_desc())},
              {DNNL_ARG_WEIGHTS, work.input("w", w_dims, Tag::hwio, forward.weights_desc())},
              {DNNL_ARG_DST, result}});
    work.result("y", result, y_dims, Tag::nhwc, {height, width, out});
  } else if (part == "data gradient") {
    const dnnl::convolution_backward_data::primitive_desc backward(
        {convolution_algorithm, x_any, w, y_any, one, one, one}, work.engine(), forward);
    const memory result = work.empty(backward.diff_src_desc());
    work.add(dnnl::convolution_backward_data(backward),
             {{DNNL_ARG_DIFF_DST, work.input("g", y_dims, Tag::nhwc, backward.diff_dst_desc())},
              {DNNL_ARG_WEIGHTS, work.input("w", w_dims, Tag::hwio, backward.weights_desc())},
              {DNNL_ARG_DIFF_SRC, result}});
    work.result("y", result, x_dims, Tag::nhwc, {height, width, in});
  } else {
    const dnnl::convolution_backward_weights::primitive_desc backward(
        {convolution_algorithm, x_any, w, y_any, one, one, one}, work.engine(), forward);
    const memory result = work.empty(backward.diff_weights_desc());
    work.add(dnnl::convolution_backward_weights(backward),
             {{DNNL_ARG_SRC, work.input("x", x_dims, Tag::nhwc, backward.src_desc())},
              {DNNL_ARG_DIFF_DST, work.input("g", y_dims, Tag::nhwc, backward.diff_dst_desc())},
              {DNNL_ARG_DIFF_WEIGHTS, result}});
    work.result("y", result, w_dims, Tag::hwio, {3, 3, in, out});
  }
}

void product(Sequence& work, const nlohmann::json& request) {
  const std::int64_t rows = request.at("rows"), in = request.at("in"), out = request.at("out");
  const auto multiply = [&](const memory::dims& a_dims, const char* a, Tag a_tag, const memory::dims& b_dims,
                            const char* b, Tag b_tag, const std::string& name) {
    const memory::dims c_dims = {a_dims[0], b_dims[1]};
    const memory::desc a_desc = work.plain(a_dims, a_tag), c_desc = work.plain(c_dims, Tag::ab);
    // Weights may be in any layout; where both operands come from the step before, they are what they are.
    const memory::desc b_desc = b == std::string("w") ? work.any(b_dims) : work.plain(b_dims, b_tag);
    const dnnl::matmul::primitive_desc description({a_desc, b_desc, c_desc}, work.engine());
    const memory result = work.empty(c_desc);
    work.add(dnnl::matmul(description),
             {{DNNL_ARG_SRC, work.input(a, a_dims, a_tag, a_desc)},
              {DNNL_ARG_WEIGHTS, work.input(b, b_dims, b_tag, description.weights_desc())},
              {DNNL_ARG_DST, result}});
    work.result(name, result, c_dims, Tag::ab, {c_dims[0], c_dims[1]});
  };
  if (request.at("part") == "forward") {
    multiply({rows, in}, "x", Tag::ab, {in, out}, "w", Tag::ab, "y");
  } else {
    multiply({rows, out}, "g", Tag::ab, {out, in}, "w", Tag::ba, "gradient of x");
    multiply({in, rows}, "x", Tag::ba, {rows, out}, "g", Tag::ab, "gradient of w");
  }
}

/// One call for each layer and direction: ReLU in the epilogue forward, a call of its own backward.
void perceptron(Sequence& work, const nlohmann::json& request) {
  const std::int64_t rows = request.at("rows");
  const std::vector<std::int64_t> widths = request.at("widths");
  const std::size_t layers = widths.size() - 1;
  const auto matrix = [&](std::size_t layer) { return work.plain({rows, widths[layer]}, Tag::nc); };
  std::vector<memory> values = {work.input("x", {rows, widths[0]}, Tag::nc, matrix(0))};
  std::vector<dnnl::inner_product_forward::primitive_desc> forward;
  for (std::size_t i = 0; i < layers; ++i) {
    const memory::dims w_dims = {widths[i + 1], widths[i]}, b_dims = {widths[i + 1]};
    const memory::desc b = {b_dims, Type::f32, Tag::x};
    dnnl::primitive_attr attributes;
    if (i + 1 < layers) {
      dnnl::post_ops relu;
      relu.append_eltwise(1, algorithm::eltwise_relu, 0, 0);
      attributes.set_post_ops(relu);
    }
    forward.emplace_back(dnnl::inner_product_forward::desc{prop_kind::forward_training, matrix(i),
                                                           work.any(w_dims), b, matrix(i + 1)},
                         attributes, work.engine());
    values.push_back(work.empty(matrix(i + 1)));
    work.add(
        dnnl::inner_product_forward(forward[i]),
        {{DNNL_ARG_SRC, values[i]},
         {DNNL_ARG_WEIGHTS, work.input(fmt::format("w{}", i), w_dims, Tag::io, forward[i].weights_desc())},
         {DNNL_ARG_BIAS, work.input(fmt::format("b{}", i), b_dims, Tag::x, b)},
         {DNNL_ARG_DST, values[i + 1]}});
  }
  work.result("y", values.back(), {rows, widths.back()}, Tag::nc, {rows, widths.back()});
  if (request.at("part") == "forward") return;

  memory gradient = work.input("g", {rows, widths[layers]}, Tag::nc, matrix(layers));
  for (std::size_t i = layers; i-- > 0;) {
    const memory::dims w_dims = {widths[i + 1], widths[i]}, b_dims = {widths[i + 1]};
    const memory::desc b = {b_dims, Type::f32, Tag::x}, w_any = {w_dims, Type::f32, Tag::any};
    if (i + 1 < layers) {
      const dnnl::eltwise_forward::primitive_desc relu(
          {prop_kind::forward_training, algorithm::eltwise_relu_use_dst_for_bwd, matrix(i + 1), 0.0f},
          work.engine());
      const dnnl::eltwise_backward::primitive_desc backward(
          {algorithm::eltwise_relu_use_dst_for_bwd, matrix(i + 1), matrix(i + 1), 0.0f}, work.engine(), relu);
      work.add(dnnl::eltwise_backward(backward),
               {{DNNL_ARG_DST, values[i + 1]}, {DNNL_ARG_DIFF_DST, gradient}, {DNNL_ARG_DIFF_SRC, gradient}});
    }
    const dnnl::inner_product_backward_weights::primitive_desc to_weights(
        {matrix(i), w_any, b, matrix(i + 1)}, work.engine(), forward[i]);
    const memory grad_w = work.empty(to_weights.diff_weights_desc()), grad_b = work.empty(b),
                 grad_x = work.empty(matrix(i));
    work.add(dnnl::inner_product_backward_weights(to_weights), {{DNNL_ARG_SRC, values[i]},
                                                                {DNNL_ARG_DIFF_DST, gradient},
                                                                {DNNL_ARG_DIFF_WEIGHTS, grad_w},
                                                                {DNNL_ARG_DIFF_BIAS, grad_b}});
    const dnnl::inner_product_backward_data::primitive_desc to_data(
        {matrix(i), work.any(w_dims), matrix(i + 1)}, work.engine(), forward[i]);
    work.add(dnnl::inner_product_backward_data(to_data),
             {{DNNL_ARG_DIFF_DST, gradient},
              {DNNL_ARG_WEIGHTS, work.input(fmt::format("w{}", i), w_dims, Tag::io, to_data.weights_desc())},
              {DNNL_ARG_DIFF_SRC, grad_x}});
    work.result(fmt::format("gradient of w{}", i), grad_w, w_dims, Tag::io, {widths[i], widths[i + 1]});
    work.result(fmt::format("gradient of b{}", i), grad_b, b_dims, Tag::x, {widths[i + 1]});
    gradient = grad_x;
  }
  work.result("gradient of x", gradient, {rows, widths[0]}, Tag::nc, {rows, widths[0]});
}

Peer load(const nlohmann::json& request, const TensorFile& inputs) {
  const std::string workload = request.at("workload");
  const auto work = std::make_shared<Sequence>(inputs, request.at("mode") == "bf16" ? Type::bf16 : Type::f32);
  if (workload == "convolution")
    convolution(*work, request);
  else if (workload == "product")
    product(*work, request);
  else if (workload == "perceptron")
    perceptron(*work, request);
  else
    fail("oneDNN takes no part in {}", workload);
  return {[=] { work->run(); }, [=] { return work->results(); }};
}

}  // namespace
}  // namespace vivant::peers

int main(int argc, char** argv) {
  using namespace vivant::peers;
  if (argc > 1 && std::string(argv[1]) == "Winograd") convolution_algorithm = algorithm::convolution_winograd;
  serve(load);
}
