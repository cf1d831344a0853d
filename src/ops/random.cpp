#include "vivant/ops/random.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

void check_key(std::string_view op, const TensorTypes& in) {
  for (int i : {0, 1})
    if (in[i].dtype != DType::i32 || in[i].shape.elements() != 1)
      fail("[{}] {} must be i32 [1], it is {} {}", op, i == 0 ? "seed" : "step", name_of(in[i].dtype),
           in[i].shape.text());
}

std::array<std::size_t, 3> blocks(const Tensor& y) {
  return {static_cast<std::size_t>((y.elements() + 3) / 4), 1, 1};
}

struct Uniform final : Op {
  Uniform(Shape shape, int stream) : shape(std::move(shape)), stream(stream) {}
  std::string_view name() const override { return "random_uniform"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_key(name(), in);
    return {{DType::real, shape}};
  }
  void launch(Launch& launch) const override {
    launch.kernel("random.cl", "random_uniform")
        .args(launch.in(0), launch.in(1), launch.out(), stream, launch.out().elements())
        .run(blocks(launch.out()), {64, 1, 1});
  }
  const Shape shape;
  const int stream;
};

/// Inputs: seed, step, and a list of `end` integers or nothing.
struct Integers final : Op {
  Integers(Shape shape, std::int64_t end, int stream) : shape(std::move(shape)), end(end), stream(stream) {}
  std::string_view name() const override { return "random_integers"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_key(name(), in);
    if (end < 1) fail("[random_integers] there is no integer in [0, {})", end);
    if (in[2].shape.rank() > 0 && in[2].dtype != DType::i32) fail("[pick] the list must be i32");
    return {{DType::i32, shape}};
  }
  void launch(Launch& launch) const override {
    launch.kernel("random.cl", "random_integers")
        .args(launch.in(0), launch.in(1), launch.in(2), launch.out(), stream, launch.out().elements(), end)
        .run(blocks(launch.out()), {64, 1, 1});
  }
  const Shape shape;
  const std::int64_t end;
  const int stream;
};

const Port seed_port{"seed", "[1]", DType::i32}, step_port{"step", "[1]", DType::i32};
const AttributeInfo stream_info{"stream", 0, "a number of its own for every use in a graph"};

RandomKey key_of(const Values& in, const Attributes& a) {
  return {in[0], in[1], static_cast<int>(a.integer("stream"))};
}

const RegisterOp register_uniform({
    .name = "random_uniform",
    .summary = "uniform numbers in [0, 1)",
    .inputs = {seed_port, step_port},
    .outputs = {{"y", "[elements]"}},
    .attributes = {{"elements", 1, "how many"}, stream_info},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {random_uniform({a.integer("elements")}, key_of(in, a))};
    },
});
const RegisterOp register_integers({
    .name = "random_integers",
    .summary = "uniform integers in [0, end)",
    .inputs = {seed_port, step_port},
    .outputs = {{"y", "[elements]", DType::i32}},
    .attributes = {{"elements", 1, "how many"}, {"end", 2, "one more than the largest"}, stream_info},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {random_integers({a.integer("elements")}, a.integer("end"), key_of(in, a))};
    },
});
const RegisterOp register_pick({
    .name = "pick",
    .summary = "random entries of a list of integers",
    .inputs = {seed_port, step_port, {"list", "[L]", DType::i32}},
    .outputs = {{"y", "[number]", DType::i32}},
    .attributes = {{"number", 1, "how many"}, stream_info},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {pick(in[2], a.integer("number"), key_of(in, a))};
    },
});

}  // namespace

Value random_uniform(Shape shape, const RandomKey& key) {
  return key.seed.graph->record_one(Uniform(std::move(shape), key.stream), {key.seed, key.step});
}
Value random_integers(Shape shape, std::int64_t end, const RandomKey& key) {
  return key.seed.graph->record_one(Integers(std::move(shape), end, key.stream),
                                    {key.seed, key.step, Value{}});
}
Value pick(Value list, std::int64_t number, const RandomKey& key) {
  return list.graph->record_one(Integers({number}, list.elements(), key.stream), {key.seed, key.step, list});
}

}  // namespace vivant
