// What the graph records: shapes and their errors, gradients, and what is not recorded.
#include "vivant/graph/graph.hpp"

#include <algorithm>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/reduction.hpp"

using namespace vivant;

TEST_CASE("graph: errors name the op and what does not fit") {
  Graph graph, other;
  const Value x = graph.input("x", {5, 64}), w = graph.input("w", {32, 8});
  CHECK(error_of([&] { linear(x, w); }) == "[linear] weight has 32 input channels, x has 64");
  CHECK(contains(error_of([&] { add(x, w); }), "[add] [32, 8] does not broadcast over [5, 64]"));
  CHECK(contains(error_of([&] {
                   add(x, other.input("y", {5, 64}));
                 }),
                 "[add] an input belongs to another graph"));
  CHECK(contains(error_of([&] { graph.reshape(x, {7, 64}); }), "[reshape] [5, 64] does not hold as many"));
  CHECK(contains(error_of([&] {
                   graph.input("empty", {5, 0});
                 }),
                 "[empty] a tensor of shape [5, 0] is empty"));
  const std::vector<double> three = {1, 2, 3};
  CHECK(contains(error_of([&] { graph.constant({2}, std::span<const double>(three)); }), "holds 2 elements"));
  CHECK(contains(error_of([&] { differentiate(graph, x, {w}); }), "the loss must have one element"));
  const Value count = graph.input("count", {1}, DType::i32);
  CHECK(contains(error_of([&] { graph.with_count(x, x); }), "[with_count] the count must be i32 [1]"));
  CHECK(contains(error_of([&] { mean(graph.with_count(x, count)); }), "[mean]"));
  CHECK(contains(error_of([&] {
                   graph.with_count(graph.input("image", {2, 3, 4}), count);
                 }),
                 "only matrices"));
  CHECK(contains(error_of([&] { graph.assign(x, w); }), "[assign] [32, 8] does not fit into [5, 64]"));
}

TEST_CASE("graph: shapes and nodes stay where they are while more are recorded") {
  Graph graph;
  const Value x = graph.input("x", {5, 64});
  add(x, x);
  const Shape& shape = x.shape();
  const Graph::Node& node = graph.nodes().front();
  for (int i = 0; i < 1000; ++i) add(x, x);
  CHECK(&shape == &x.shape());
  CHECK(&node == &graph.nodes().front());
}

TEST_CASE("graph: gradients of a cube, first and second order, by hand") {
  Graph graph;
  const Value x = graph.input("x", {4});
  const Value cube = multiply(multiply(x, x), x);
  const Value first = differentiate(graph, sum(cube), {x}).front();
  const Value second = differentiate(graph, sum(first), {x}).front();
  Run run(graph, {first, second});
  run.write(x, {1, -2, 0.5f, 3});
  CHECK(run.read(first) == std::vector<float>{3, 12, 0.75f, 27});
  CHECK(run.read(second) == std::vector<float>{6, -12, 3, 18});
}

TEST_CASE("graph: the gradients of a linear layer with a squared loss, by hand") {
  // y = x w + b, loss = sum y^2: dw = 2 x^T y, db = 2 sum_rows y, dx = 2 y w^T
  Graph graph;
  const Value x = graph.input("x", {2, 2}), w = graph.input("w", {2, 1}), b = graph.input("b", {1});
  const Value y = linear(x, w, b);
  const Values grads = differentiate(graph, sum(multiply(y, y)), {x, w, b});
  Run run(graph, grads);
  run.write(x, {1, 2, 3, 4});
  run.write(w, {10, 1});
  run.write(b, {-2});
  // y = [10, 32]
  CHECK(run.read(grads[0]) == std::vector<float>{200, 20, 640, 64});
  CHECK(run.read(grads[1]) == std::vector<float>{2 * (10 + 96), 2 * (20 + 128)});
  CHECK(run.read(grads[2]) == std::vector<float>{84});
}

TEST_CASE("graph: broadcast operands get summed gradients") {
  Graph graph;
  const Value a = graph.input("a", {2, 3}), row = graph.input("row", {3}),
              column = graph.input("column", {2, 1}), one = graph.input("one", {1});
  const Value y = multiply(subtract(multiply(a, row), column), one);
  const Values grads = differentiate(graph, sum(y), {a, row, column, one});
  Run run(graph, grads);
  run.write(a, {1, 2, 3, 4, 5, 6});
  run.write(row, {1, 10, 100});
  run.write(column, {7, 8});
  run.write(one, {2});
  CHECK(run.read(grads[0]) == std::vector<float>{2, 20, 200, 2, 20, 200});
  CHECK(run.read(grads[1]) == std::vector<float>{10, 14, 18});
  CHECK(run.read(grads[2]) == std::vector<float>{-6, -6});
  CHECK(run.read(grads[3]) == std::vector<float>{321 - 21 + 654 - 24});
}

TEST_CASE("graph: gradients pass reshapes, stop at detach, and are zero where there is no path") {
  Graph graph;
  const Value x = graph.input("x", {2, 2}), unused = graph.input("unused", {3});
  const Value square = multiply(x, graph.detach(x));
  const Value flat = graph.reshape(multiply(square, square), {4});
  const Values grads = differentiate(graph, sum(flat), {x, unused, square});
  Run run(graph, grads);
  run.write(x, {1, -2, 3, 0.5f});
  CHECK(run.read(grads[2]) == std::vector<float>{2, 8, 18, 0.5f});     // 2 x^2: an intermediate value
  CHECK(run.read(grads[0]) == std::vector<float>{2, -16, 54, 0.25f});  // 2 x^2 . x
  CHECK(run.read(grads[1]) == std::vector<float>{0, 0, 0});
}

TEST_CASE("graph: an output with a seed of its own, and two outputs at once") {
  Graph graph;
  const Value x = graph.input("x", {3}), seed = graph.input("seed", {3});
  const Value a = affine(x, 2, 1), b = multiply(x, x);
  const Value grad = differentiate(graph, {a, b}, {seed, seed}, {x}).front();
  Run run(graph, {grad});
  run.write(x, {1, 2, 3});
  run.write(seed, {1, 10, 100});
  CHECK(run.read(grad) == std::vector<float>{4, 60, 800});
}

TEST_CASE("graph: frozen parameters cost nothing") {
  const auto nodes_for = [](bool first, bool second) {
    Graph graph;
    const Value x = graph.input("x", {4, 8}), w1 = graph.input("w1", {8, 8}), w2 = graph.input("w2", {8, 1});
    const Value hidden = linear(x, w1, {}, Activation::relu);
    const Value loss = sum(linear(hidden, w2));
    const std::size_t forward = graph.nodes().size();
    Values wrt;
    if (first) wrt.push_back(w1);
    if (second) wrt.push_back(w2);
    differentiate(graph, loss, wrt);
    std::vector<std::string> names;
    for (std::size_t n = forward; n < graph.nodes().size(); ++n)
      names.emplace_back(graph.nodes()[n].op->name());
    return names;
  };
  const auto count = [](const std::vector<std::string>& names, const std::string& name) {
    return std::count(names.begin(), names.end(), name);
  };
  const auto both = nodes_for(true, true), last = nodes_for(false, true), first = nodes_for(true, false);
  CHECK(count(both, "outer_sum") == 2);
  CHECK(count(both, "linear_data_gradient") == 1);  // of the hidden layer; nobody asked for x's
  CHECK(count(last, "outer_sum") == 1);
  CHECK(count(last, "linear_data_gradient") == 0);
  CHECK(count(last, "activation_gradient") == 0);
  CHECK(count(first, "outer_sum") == 1);
  CHECK(count(first, "linear_data_gradient") == 1);
  CHECK(nodes_for(false, false).empty());
}

TEST_CASE("graph: weights are packed once, whatever number of layers shares them") {
  Graph graph;
  const Value x = graph.input("x", {4, 8}), w = graph.input("w", {8, 8});
  linear(linear(linear(x, w), w), w);
  CHECK(std::count_if(graph.nodes().begin(), graph.nodes().end(),
                      [](const auto& node) { return node.op->name() == "pack_weights"; }) == 1);
  int made = 0;
  for (int i = 0; i < 2; ++i)
    graph.named("once", [&] {
      ++made;
      return x;
    });
  CHECK(made == 1);
}

TEST_CASE("graph: scopes name nodes and their gradients") {
  Graph graph;
  const Value x = graph.input("x", {3});
  Value y;
  {
    const Graph::Scope scene(graph, "scene");
    const Graph::Scope density(graph, "density");
    y = multiply(x, x);
  }
  CHECK(graph.nodes().back().scope == "scene/density");
  differentiate(graph, sum(y), {x});
  const bool named = std::any_of(graph.nodes().begin(), graph.nodes().end(),
                                 [](const auto& node) { return node.scope == "scene/density/gradient"; });
  CHECK(named);
}
