#pragma once
#include "vivant/graph/graph.hpp"
#include "vivant/graph/launch.hpp"

namespace vivant {

/// Fills a tensor with zeros.
struct Zeros final : Op {
  explicit Zeros(TensorType type) : type(std::move(type)) {}
  std::string_view name() const override { return "zeros"; }
  TensorTypes infer(const TensorTypes&) const override { return {type}; }
  void launch(Launch& launch) const override { launch.zero(launch.out()); }
  const TensorType type;
};

/// The same memory under another shape.
struct Reshape final : Op {
  explicit Reshape(Shape shape) : shape(std::move(shape)) {}
  std::string_view name() const override { return "reshape"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.elements() != shape.elements())
      fail("[reshape] {} does not hold as many elements as {}", in[0].shape.text(), shape.text());
    return {{in[0].dtype, shape, in[0].count}};
  }
  void launch(Launch&) const override {}
  bool accepts_counts() const override { return true; }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.reshape(request.grad(), request.in[0].shape())};
  }
  const Shape shape;
};

/// The same memory with another count of live rows.
struct SetCount final : Op {
  std::string_view name() const override { return "with_count"; }
  TensorTypes infer(const TensorTypes& in) const override { return in; }
  void launch(Launch&) const override {}
  bool accepts_counts() const override { return true; }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.with_count(request.grad(), request.in[0].count())};
  }
};

/// The same memory; gradients stop here.
struct Detach final : Op {
  std::string_view name() const override { return "detach"; }
  TensorTypes infer(const TensorTypes& in) const override { return in; }
  void launch(Launch&) const override {}
  bool accepts_counts() const override { return true; }
};

/// Copies the second input over the first, which is state.
struct Assign final : Op {
  std::string_view name() const override { return "assign"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].dtype != in[1].dtype || in[0].shape.elements() != in[1].shape.elements())
      fail("[assign] {} does not fit into {}", in[1].shape.text(), in[0].shape.text());
    return {};
  }
  void launch(Launch& launch) const override { launch.copy(launch.in(1), launch.in(0)); }
};

}  // namespace vivant
