#include "vivant/ops/adam.hpp"

#include <cmath>

#include "ops/rows.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::int64_t block = 64, chunk = 64 * block;

std::int64_t chunks_in(std::int64_t elements) { return (elements + chunk - 1) / chunk; }

struct Adam final : Op {
  enum Input { parameters, gradients, first, second, groups, rates, step, status, loss, overflow };

  explicit Adam(const AdamOptions& options) : options(options) {}
  std::string_view name() const override { return "adam"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const std::int64_t elements = in[parameters].shape.elements();
    if (elements % block != 0)
      fail("[adam] the parameters must fill blocks of {}, there are {}", block, elements);
    for (int i : {gradients, first, second})
      if (in[i].shape != in[parameters].shape)
        fail("[adam] the parameters are {}, but input {} is {}", in[parameters].shape.text(), i,
             in[i].shape.text());
    if (in[groups].dtype != DType::u8 || in[groups].shape.elements() != elements / block)
      fail("[adam] the groups must be u8 [{}], they are {} {}", elements / block, name_of(in[groups].dtype),
           in[groups].shape.text());
    if (in[step].dtype != DType::i32) fail("[adam] the step must be i32, it is {}", name_of(in[step].dtype));
    if (in[status].shape.rank() > 0 && (in[status].dtype != DType::i32 || in[status].shape != Shape{3}))
      fail("[adam] the status must be i32 [3], it is {} {}", name_of(in[status].dtype),
           in[status].shape.text());
    if (in[overflow].shape.rank() > 0 && (in[overflow].dtype != DType::i32 || in[status].shape.rank() == 0))
      fail("[adam] an overflow must be i32 and needs a status");
    return {};
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::i32, {chunks_in(in[parameters].shape.elements())}}, {DType::real, {2}}};
  }
  void launch(Launch& launch) const override {
    const std::int64_t elements = launch.in(parameters).elements(), chunks = chunks_in(elements);
    const Tensor &bad = launch.workspace(0), &corrections = launch.workspace(1);
    if (launch.in(status))
      launch.kernel("adam.cl", "adam_find")
          .args(launch.in(gradients), launch.in(groups), bad, elements, chunk)
          .run({static_cast<std::size_t>(chunks), 1, 1}, {1, 1, 1});
    launch.kernel("adam.cl", "adam_prepare")
        .args(bad, launch.in(step), launch.in(loss), launch.in(overflow), launch.in(status), corrections,
              chunks, std::log(options.beta1), std::log(options.beta2))
        .run({1, 1, 1}, {1, 1, 1});
    launch.kernel("adam.cl", "adam_update")
        .args(launch.in(parameters), launch.in(gradients), launch.in(first), launch.in(second),
              launch.in(groups), launch.in(rates), launch.in(status), corrections, elements, options.beta1,
              1 - options.beta1, options.beta2, 1 - options.beta2, options.epsilon)
        .run(vectors(launch, elements), vector_group());
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 12.0 * static_cast<double>(in[parameters].shape.elements());
  }
  const AdamOptions options;
};

/// By name, the op leaves its inputs alone and returns copies of the state after the step.
Values adam_on_copies(Graph& graph, const Values& in, const Attributes& attributes) {
  const auto copy = [&](Value x) {
    if (!x) return Value{};
    const Value y = graph.zeros(x.type());
    graph.assign(y, x);
    return y;
  };
  const AdamState state{.parameters = copy(in[Adam::parameters]),
                        .gradients = in[Adam::gradients],
                        .first_moments = copy(in[Adam::first]),
                        .second_moments = copy(in[Adam::second]),
                        .groups = in[Adam::groups],
                        .rates = in[Adam::rates],
                        .step = in[Adam::step],
                        .status = copy(in[Adam::status]),
                        .loss = in[Adam::loss],
                        .overflow = in[Adam::overflow]};
  adam(state, {attributes.number("beta1"), attributes.number("beta2"), attributes.number("epsilon")});
  Values after = {state.parameters, state.first_moments, state.second_moments};
  if (state.status) after.push_back(state.status);
  return after;
}

const RegisterOp register_adam({
    .name = "adam",
    .summary = "one step of Adam over a flat buffer of parameters",
    .inputs = {{"parameters", "[P]"},
               {"gradients", "[P]"},
               {"first_moments", "[P]"},
               {"second_moments", "[P]"},
               {"groups", "[P / 64]", DType::u8},
               {"rates", "[G]"},
               {"step", "[1]", DType::i32},
               {"status", "[3]", DType::i32, true},
               {.name = "loss", .shape = "[1]", .optional = true},
               {"overflow", "[1]", DType::i32, true}},
    .outputs = {{"parameters", "[P]"},
                {"first_moments", "[P]"},
                {"second_moments", "[P]"},
                {"status", "[3]", DType::i32, true}},
    .attributes = {{"beta1", 0.9, "decay of the first moments"},
                   {"beta2", 0.99, "decay of the second moments"},
                   {"epsilon", 1e-8, "added to the root of the second moments"}},
    .build = adam_on_copies,
});

}  // namespace

void adam(const AdamState& s, const AdamOptions& options) {
  s.parameters.graph->record(std::make_shared<Adam>(options),
                             {s.parameters, s.gradients, s.first_moments, s.second_moments, s.groups, s.rates,
                              s.step, s.status, s.loss, s.overflow},
                             true);
}

}  // namespace vivant
