#include "vivant/ops/positional_encoding.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct PositionalEncodingGradient final : Op {
  explicit PositionalEncodingGradient(int frequencies) : frequencies(frequencies) {}
  std::string_view name() const override { return "positional_encoding_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("positional_encoding.cl", "positional_encoding_gradient")
        .args(x, launch.in(1), launch.out(), x.rows(), x.channels(), frequencies, launch.count_of(x))
        .run({static_cast<std::size_t>(x.rows()), 1, 1}, {64, 1, 1});
  }
  const int frequencies;
};

struct PositionalEncoding final : Op {
  explicit PositionalEncoding(int frequencies) : frequencies(frequencies) {}
  std::string_view name() const override { return "positional_encoding"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (frequencies < 0) fail("[positional_encoding] {} frequencies", frequencies);
    return {{DType::real, in[0].shape.with_channels(in[0].shape.channels() * (1 + 2 * frequencies)),
             in[0].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    launch.kernel("positional_encoding.cl", "positional_encoding")
        .args(x, launch.out(), x.rows(), x.channels(), frequencies, launch.count_of(x))
        .run({static_cast<std::size_t>(x.rows()), 1, 1}, {64, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    return {
        request.graph.record_one(PositionalEncodingGradient(frequencies), {request.in[0], request.grad()})};
  }
  const int frequencies;
};

const RegisterOp registration({
    .name = "positional_encoding",
    .summary = "gamma(x) = (x, sin(2^l pi x), cos(2^l pi x))",
    .inputs = {{"x", "[N, D]"}},
    .outputs = {{"y", "[N, D (1 + 2 L)]"}},
    .attributes = {{"frequencies", 6, "L, the number of octaves"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {positional_encoding(in[0], static_cast<int>(a.integer("frequencies")))};
    },
});

}  // namespace

Value positional_encoding(Value x, int frequencies) {
  return x.graph->record_one(PositionalEncoding(frequencies), {x});
}

}  // namespace vivant
