#include "dnnl_kernels.hpp"

#include <dnnl.hpp>
#include <unordered_map>

namespace vivant::peers {
namespace {

using dnnl::algorithm;
using dnnl::memory;
using dnnl::prop_kind;
using Tag = memory::format_tag;
constexpr auto f32 = memory::data_type::f32;

struct Context {
  dnnl::engine engine{dnnl::engine::kind::cpu, 0};
  dnnl::stream stream{engine};
};

Context& context() {
  static Context one;
  return one;
}

memory upload(const memory::desc& description, const std::vector<float>& data) {
  memory target(description, context().engine);
  std::copy(data.begin(), data.end(), static_cast<float*>(target.get_data_handle()));
  return target;
}

memory reordered(memory source, const memory::desc& wanted) {
  if (source.get_desc() == wanted) return source;
  memory target(wanted, context().engine);
  dnnl::reorder(source, target).execute(context().stream, source, target);
  context().stream.wait();
  return target;
}

Peer peer(const dnnl::primitive& primitive, const std::unordered_map<int, memory>& arguments, memory result,
          const memory::desc& plain) {
  return {.run =
              [=] {
                primitive.execute(context().stream, arguments);
                context().stream.wait();
              },
          .result =
              [=] {
                const memory target = reordered(result, plain);
                const auto* data = static_cast<const float*>(target.get_data_handle());
                return std::vector<float>(data, data + plain.get_size() / sizeof(float));
              }};
}

}  // namespace

Peer convolution(ConvolutionSize size, Direction direction, const std::vector<float>& image,
                 const std::vector<float>& weights, const std::vector<float>& gradient) {
  const dnnl::engine& engine = context().engine;
  const memory::desc x({1, size.in, size.height, size.width}, f32, Tag::nhwc),
      y({1, size.out, size.height, size.width}, f32, Tag::nhwc), w({size.out, size.in, 3, 3}, f32, Tag::any),
      hwio({size.out, size.in, 3, 3}, f32, Tag::hwio);
  const memory::dims one = {1, 1};
  const dnnl::convolution_forward::primitive_desc forward(
      {prop_kind::forward_training, algorithm::convolution_direct, x, w, y, one, one, one}, engine);
  switch (direction) {
    case Direction::forward: {
      memory out(y, engine);
      return peer(dnnl::convolution_forward(forward),
                  {{DNNL_ARG_SRC, upload(x, image)},
                   {DNNL_ARG_WEIGHTS, reordered(upload(hwio, weights), forward.weights_desc())},
                   {DNNL_ARG_DST, out}},
                  out, y);
    }
    case Direction::data_gradient: {
      const dnnl::convolution_backward_data::primitive_desc backward(
          {algorithm::convolution_direct, x, w, y, one, one, one}, engine, forward);
      memory out(x, engine);
      return peer(dnnl::convolution_backward_data(backward),
                  {{DNNL_ARG_DIFF_DST, upload(y, gradient)},
                   {DNNL_ARG_WEIGHTS, reordered(upload(hwio, weights), backward.weights_desc())},
                   {DNNL_ARG_DIFF_SRC, out}},
                  out, x);
    }
    case Direction::weight_gradient:
      break;
  }
  const dnnl::convolution_backward_weights::primitive_desc backward(
      {algorithm::convolution_direct, x, w, y, one, one, one}, engine, forward);
  memory out(backward.diff_weights_desc(), engine);
  return peer(dnnl::convolution_backward_weights(backward),
              {{DNNL_ARG_SRC, upload(x, image)},
               {DNNL_ARG_DIFF_DST, upload(y, gradient)},
               {DNNL_ARG_DIFF_WEIGHTS, out}},
              out, hwio);
}

Peer product(ProductSize size, const std::vector<float>& x, const std::vector<float>& w) {
  const memory::desc a({size.rows, size.in}, f32, Tag::ab), b({size.in, size.out}, f32, Tag::ab),
      any({size.in, size.out}, f32, Tag::any), c({size.rows, size.out}, f32, Tag::ab);
  const dnnl::matmul::primitive_desc description({a, any, c}, context().engine);
  memory out(c, context().engine);
  return peer(dnnl::matmul(description),
              {{DNNL_ARG_SRC, upload(a, x)},
               {DNNL_ARG_WEIGHTS, reordered(upload(b, w), description.weights_desc())},
               {DNNL_ARG_DST, out}},
              out, c);
}

}  // namespace vivant::peers
