// What the executor promises: it runs what is asked for, again and again, and nothing else.
#include "vivant/graph/executor.hpp"

#include <limits>

#include "environment.hpp"
#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "opencl_calls.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/mlp.hpp"
#include "vivant/ops/reduction.hpp"

using namespace vivant;

namespace {

/// Two layers, a loss, the gradients of the weights, and a step of gradient descent on weights that live
/// outside.
struct TinyTraining {
  TinyTraining() {
    w1 = external("w1", {8, 16});
    w2 = external("w2", {16, 1});
    x = graph.input("x", {32, 8});
    loss = mean(multiply(linear(linear(x, w1, {}, Activation::softplus), w2), graph.input("sign", {32, 1})));
    const Values grads = differentiate(graph, loss, {w1, w2});
    graph.assign(w1, subtract(w1, affine(grads[0], 0.1)));
    graph.assign(w2, subtract(w2, affine(grads[1], 0.1)));
  }
  Value external(const std::string& name, const Shape& shape) {
    const std::size_t bytes = static_cast<std::size_t>(shape.elements()) * sizeof(float);
    return graph.external(name, {DType::real, shape},
                          {std::make_shared<Buffer>(test_device().allocate(bytes)), 0});
  }
  static void fill(Executor& step, Value value, float scale) {
    std::vector<float> data(value.elements());
    for (std::size_t i = 0; i < data.size(); ++i)
      data[i] = scale * static_cast<float>(static_cast<int>(i * 37 % 23) - 11);
    step.write(value, std::span<const float>(data));
  }
  void start(Executor& step) const {
    fill(step, w1, 0.02f);
    fill(step, w2, 0.03f);
    fill(step, x, 0.1f);
    fill(step, Value{const_cast<Graph*>(&graph), x.id + 1}, 0.2f);
  }
  Graph graph;
  Value x, w1, w2, loss;
};

}  // namespace

TEST_CASE("executor: a step allocates, compiles and waits for nothing, and gives the same bits again") {
  TinyTraining training;
  const OpenClCalls at_first = opencl_calls();
  Executor step(test_device(), training.graph, {training.loss});
  CHECK(opencl_calls().allocations > at_first.allocations + 10);
  CHECK(opencl_calls().compilations > at_first.compilations + 10);
  std::vector<float> first_weights;
  for (int repeat = 0; repeat < 2; ++repeat) {
    training.start(step);
    test_device().finish();
    const OpenClCalls before = opencl_calls();
    const int programs = test_device().programs_built() + test_device().programs_loaded();
    for (int i = 0; i < 20; ++i) step.run();
    CHECK(opencl_calls().launches >= before.launches + 20 * 10);
    CHECK(opencl_calls().allocations == before.allocations);
    CHECK(opencl_calls().compilations == before.compilations);
    CHECK(opencl_calls().waits == before.waits);
    CHECK(test_device().programs_built() + test_device().programs_loaded() == programs);
    const std::vector<float> weights = step.read(training.w1);
    CHECK(opencl_calls().waits > before.waits);  // the counter works
    if (repeat == 0) first_weights = weights;
    CHECK(weights == first_weights);
  }
}

TEST_CASE("executor: steps reduce the loss, in one slab and in many small ones, to the same bits") {
  std::vector<float> results[2];
  for (int variant = 0; variant < 2; ++variant) {
    TinyTraining training;
    ExecutorOptions options;
    if (variant == 1) options.slab_bytes = 1024;
    Executor step(test_device(), training.graph, {training.loss}, options);
    training.start(step);
    step.run();
    const float before = step.read(training.loss)[0];
    step.scramble(0xFF);
    for (int i = 0; i < 30; ++i) step.run();
    CHECK(step.read(training.loss)[0] < before - 0.01f);
    results[variant] = step.read(training.w1);
    CHECK(step.arena_bytes() >= step.lower_bound_bytes() / 2);
    CHECK(step.arena_bytes() <= 4 * step.lower_bound_bytes() + 4096);
    CHECK(step.flops() > 0);
  }
  CHECK(results[0] == results[1]);
}

TEST_CASE("executor: what lies between an mlp's layers has memory only where a gradient reads it") {
  Graph graph;
  const Value x = graph.input("x", {1024, 4}), w = graph.input("w", {4, 64}), v = graph.input("v", {64, 1});
  const Value y = mlp(x, std::vector<MlpLayer>{{w, {}}, {v, {}}});
  const Values gradients = differentiate(graph, {y}, {graph.input("seed", {1024, 1})}, {w});
  constexpr std::size_t hidden = 1024 * 64 * sizeof(float);
  CHECK(Executor(test_device(), graph, {y}).arena_bytes() < hidden);
  CHECK(Executor(test_device(), graph, {y, gradients[0]}).arena_bytes() >= hidden);
}

TEST_CASE("executor: what nobody needs is left out") {
  Graph graph;
  const Value x = graph.input("x", {64});
  const Value wanted = affine(x, 2);
  const Value unwanted = activate(affine(multiply(x, x), 3), Activation::sigmoid);
  Run lean(graph, {wanted}), whole(graph, {wanted, unwanted});
  CHECK(lean.executor().launches() == 1);
  CHECK(whole.executor().launches() == 4);
  CHECK_FALSE(contains(lean.executor().plan(), "multiply"));
  CHECK(contains(whole.executor().plan(), "multiply"));
  CHECK(contains(whole.executor().plan(), "[64]"));
  CHECK(contains(whole.executor().dot(), "digraph"));
  CHECK(contains(whole.executor().dot(), "activation"));
  lean.write(x, std::vector<float>(64, 4));
  CHECK(lean.read(wanted) == std::vector<float>(64, 8));
  CHECK(contains(error_of([&] { lean.executor().read(unwanted); }), "not an output of this executor"));
}

TEST_CASE("executor: intermediate values cannot be read, as their memory is shared") {
  Graph graph;
  const Value x = graph.input("x", {64});
  const Value middle = affine(x, 2), end = affine(middle, 3);
  Run run(graph, {end});
  run.write(x, std::vector<float>(64, 1));
  CHECK(run.read(end)[0] == 6);
  CHECK(run.executor().read(x)[0] == 1);
  CHECK(contains(error_of([&] { run.executor().read(middle); }), "affine"));
}

TEST_CASE("executor: aliases share memory and keep it alive") {
  Graph graph;
  const Value x = graph.input("x", {2, 3});
  const Value y = affine(x, 2);
  const Value flat = graph.reshape(y, {6}), back = graph.reshape(flat, {3, 2});
  Value other = affine(x, 5);  // would take y's memory, were it free
  for (int i = 0; i < 4; ++i) other = affine(other, 1, 1);
  const Value z = add(graph.reshape(flat, {2, 3}), other);
  Run run(graph, {z, back});
  run.write(x, {1, 2, 3, 4, 5, 6});
  CHECK(run.read(z) == std::vector<float>{11, 18, 25, 32, 39, 46});
  CHECK(run.executor().read(back) == std::vector<float>{2, 4, 6, 8, 10, 12});
}

TEST_CASE("executor: assignments happen in the order in which they were recorded") {
  Graph graph;
  const Value state = graph.input("state", {2});
  const Value before = affine(state, 10);
  graph.assign(state, affine(state, 1, 1));
  const Value between = affine(state, 10);
  graph.assign(state, affine(state, 2));
  Run run(graph, {before, between});
  run.write(state, {1, 2});
  CHECK(run.read(before) == std::vector<float>{10, 20});
  CHECK(run.executor().read(between) == std::vector<float>{20, 30});
  CHECK(run.executor().read(state) == std::vector<float>{4, 6});
  CHECK(run.read(before) == std::vector<float>{40, 60});  // state lives from run to run
}

TEST_CASE("executor: rows beyond a count are left alone, and the count may change from run to run") {
  Graph graph;
  const Value count = graph.scalar("count", DType::i32);
  const Value x = graph.with_count(graph.input("x", {5, 2}), count);
  const Value y = affine(x, 2), total = sum_rows(y);
  Run run(graph, {y, total});
  run.write(x, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10});
  for (int live : {0, 1, 3, 5, 2}) {
    run.executor().set(count, live);
    run.executor().scramble(0);
    const std::vector<float> rows = run.read(y);
    for (int i = 0; i < 10; ++i) CHECK(rows[i] == (i < 2 * live ? 2.0f * static_cast<float>(i + 1) : 0.0f));
    const auto n = static_cast<float>(live);
    CHECK(run.executor().read(total) == std::vector<float>{2 * n * n, 2 * n * (n + 1)});
  }
}

TEST_CASE("executor: a value that is not finite names the op and its scope") {
  Graph graph;
  const Value x = graph.input("x", {2, 3});
  Value y;
  {
    const Graph::Scope scope(graph, "scene");
    y = multiply(x, x);
  }
  const Value z = affine(y, 0);
  Run run(graph, {z});
  run.write(x, {1, 2, 3, 4, 5, 6});
  CHECK_NOTHROW(run.executor().run_checked());
  run.write(x, {1, 2, 3, 4, 1e30f, 6});
  CHECK(error_of([&] { run.executor().run_checked(); }) ==
        "the output of scene/multiply [2, 3] is not finite at element 4");
  run.write(x, {std::numeric_limits<float>::quiet_NaN(), 2, 3, 4, 5, 6});
  CHECK(contains(error_of([&] { run.executor().run_checked(); }),
                 "scene/multiply [2, 3] is not finite at element 0"));
}

TEST_CASE("executor: wrong writes and reads are refused") {
  Graph graph;
  const Value x = graph.input("x", {2, 3}), n = graph.scalar("n", DType::i32);
  const Value y = affine(x, 1);
  Run run(graph, {y});
  CHECK(contains(error_of([&] {
                   run.write(y, {1, 2, 3, 4, 5, 6});
                 }),
                 "affine [2, 3] is computed by the graph"));
  CHECK(contains(error_of([&] { run.write(x, {1, 2}); }), "[2, 3] takes 6 elements, not 2"));
  const std::vector<std::int32_t> ints(6, 1);
  CHECK(contains(error_of([&] { run.executor().write(x, std::span<const std::int32_t>(ints)); }),
                 "is f32, the data i32"));
  CHECK(contains(error_of([&] { run.executor().set(x, 1); }), "numbers, not 1"));
  CHECK(contains(error_of([&] { run.executor().read_ints(x); }), "is f32"));
  run.executor().set(n, 7);
  CHECK(run.executor().read_ints(n) == std::vector<std::int32_t>{7});
}

namespace {

/// Writes one element too many: for the test of the guard bands.
struct Overrun final : Op {
  explicit Overrun(std::string function) : function(std::move(function)) {}
  std::string_view name() const override { return "overrun"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  void launch(Launch& launch) const override {
    launch.kernel("overrun.cl", function)
        .args(launch.out(), launch.out().elements())
        .run({1, 1, 1}, {1, 1, 1});
  }
  const std::string function;
};

}  // namespace

TEST_CASE("executor: guard bands find a kernel that writes outside of its tensor") {
  const TemporaryFolder kernels;
  write_file(kernels / "overrun.cl",
             "__kernel void before(__global float* y, int n) { for (int i = -1; i < n; ++i) y[i] = 0; }\n"
             "__kernel void behind(__global float* y, int n) { for (int i = 0; i <= n; ++i) y[i] = 0; }\n"
             "__kernel void within(__global float* y, int n) { for (int i = 0; i < n; ++i) y[i] = 0; }\n");
  const ScopedVariable variable("VIVANT_KERNELS", kernels.path().string());
  const auto finding = [](const std::string& function) {
    Graph graph;
    const Value y = graph.record_one(Overrun(function), {graph.input("x", {7})});
    ExecutorOptions options;
    options.guard_bytes = 256;
    Executor executor(test_device(), graph, {y}, options);
    executor.run();
    return error_of([&] { executor.check_guards(); });
  };
  CHECK(finding("within").empty());
  CHECK(contains(finding("before"), "bytes before the memory of an output of overrun"));
  CHECK(contains(finding("behind"), "behind the memory of an output of overrun"));
}
