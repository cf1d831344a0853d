#include "vivant/ops/adam.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "cases/op_case.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/nn/optimizer.hpp"

using namespace vivant;

namespace {

constexpr std::int64_t elements = 64 * 5;
const std::vector<std::uint8_t> groups = {0, 1, 255, 1, 0};

/// Adam on its own, with everything that it reads and writes as inputs that keep their content between runs.
struct Training {
  explicit Training(Device& device) {
    state = {.parameters = graph.input("parameters", {elements}),
             .gradients = graph.input("gradients", {elements}),
             .first_moments = graph.input("first", {elements}),
             .second_moments = graph.input("second", {elements}),
             .groups = graph.input("groups", {elements / 64}, DType::u8),
             .rates = graph.input("rates", {2}),
             .step = graph.scalar("step", DType::i32),
             .status = graph.input("status", {3}, DType::i32),
             .loss = graph.scalar("loss")};
    adam(state, {.beta1 = 0.9, .beta2 = 0.99, .epsilon = 1e-8});
    executor = std::make_unique<Executor>(device, graph, Values{});
    const std::vector<float> zeros(elements, 0.0f), rates = {0.1f, 0.01f};
    const std::vector<std::int32_t> fine = {0, 0, 0};
    executor->write(state.parameters, std::span<const float>(zeros));
    executor->write(state.first_moments, std::span<const float>(zeros));
    executor->write(state.second_moments, std::span<const float>(zeros));
    executor->write(state.groups, std::span<const std::uint8_t>(groups));
    executor->write(state.rates, std::span<const float>(rates));
    executor->write(state.status, std::span<const std::int32_t>(fine));
    executor->set(state.loss, 1);
  }
  void run(int step, const std::vector<double>& gradient) {
    executor->set(state.step, step);
    executor->write(state.gradients, std::span<const double>(gradient));
    executor->run();
  }
  std::vector<std::vector<float>> read() {
    return {executor->read(state.parameters), executor->read(state.first_moments),
            executor->read(state.second_moments)};
  }
  std::vector<std::int32_t> status() { return executor->read_ints(state.status); }

  Graph graph;
  AdamState state;
  std::unique_ptr<Executor> executor;
};

std::vector<double> gradient_of(int step) {
  return cases::Random(static_cast<std::uint64_t>(step)).tensor({elements}, -0.5, 1).data;
}

}  // namespace

TEST_CASE("adam follows a double precision implementation over many steps and repeats its bits") {
  Device device;
  Training first(device), second(device);
  std::vector<double> p(elements, 0.0), m = p, v = p;
  for (int step = 1; step <= 20; ++step) {
    const std::vector<double> g = gradient_of(step);
    first.run(step, g);
    second.run(step, g);
    for (std::int64_t i = 0; i < elements; ++i) {
      const int group = groups[i / 64];
      if (group == 255) continue;
      m[i] = 0.9 * m[i] + 0.1 * g[i];
      v[i] = 0.99 * v[i] + 0.01 * g[i] * g[i];
      p[i] -= (group == 0 ? 0.1 : 0.01) * m[i] / (1 - std::pow(0.9, step)) /
              (std::sqrt(v[i] / (1 - std::pow(0.99, step))) + 1e-8);
    }
  }
  const auto got = first.read();
  CHECK(got == second.read());
  for (std::int64_t i = 0; i < elements; ++i) {
    CHECK(got[0][i] == doctest::Approx(p[i]).epsilon(1e-5).scale(1));
    CHECK(got[1][i] == doctest::Approx(m[i]).epsilon(1e-5).scale(1));
    CHECK(got[2][i] == doctest::Approx(v[i]).epsilon(1e-5).scale(1));
  }
  CHECK(first.status() == std::vector<std::int32_t>{0, 0, 0});
}

TEST_CASE("adam leaves the last good state alone from the first gradient or loss on that is not finite") {
  Device device;
  const double inf = std::numeric_limits<double>::infinity();
  for (const bool bad_loss : {false, true}) {
    Training training(device);
    training.run(1, gradient_of(1));
    const auto good = training.read();
    std::vector<double> bad = gradient_of(2);
    if (bad_loss)
      training.executor->set(training.state.loss, -inf);
    else
      bad[200] = inf;
    training.run(2, bad);
    CHECK(training.read() == good);
    const std::vector<std::int32_t> what =
        bad_loss ? std::vector<std::int32_t>{2, 2, -1} : std::vector<std::int32_t>{1, 2, 200};
    CHECK(training.status() == what);
    training.executor->set(training.state.loss, 1);
    training.run(3, gradient_of(3));
    CHECK(training.read() == good);
    CHECK(training.status() == what);
  }
}

TEST_CASE("adam: rates warm up, decay and cool down") {
  const RateSchedule decaying{.steps = 1000, .warmup = 10, .decay = 0.25};
  CHECK(decaying.rate(2, 0) == doctest::Approx(0.2));
  CHECK(decaying.rate(2, 500) == doctest::Approx(1));
  CHECK(decaying.rate(2, 1000) == doctest::Approx(0.5));
  const RateSchedule cooling{.steps = 1000, .decay = 0.25, .cooldown = 0.4};
  CHECK(cooling.rate(2, 600) == decaying.rate(2, 600));
  CHECK(cooling.rate(2, 800) == doctest::Approx(0.5 * decaying.rate(2, 800)));
  CHECK(cooling.rate(2, 999) == doctest::Approx(0.0025 * decaying.rate(2, 999)));
  CHECK(cooling.rate(2, 1000) == 0);
  CHECK(cooling.rate(2, 2000) == 0);  // a run that goes on beyond its steps
  CHECK(RateSchedule{}.rate(3, 0) == 3);
}
