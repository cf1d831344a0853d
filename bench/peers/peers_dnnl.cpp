// Our conv2d and linear against oneDNN's fp32 direct convolutions and matrix products, in turn in the same
// run and on all cores. Ours packs the weights in every run, as training must; oneDNN gets them in its own
// layout beforehand.
//   peers_dnnl [repetitions, 15]
#include <fmt/format.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "dnnl_kernels.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/linear.hpp"

using namespace vivant;
using namespace vivant::peers;

namespace {

constexpr double largest_difference = 1e-4;

std::vector<float> numbers(std::int64_t count) {
  static std::uint64_t state = 1;
  std::vector<float> values(static_cast<std::size_t>(count));
  for (float& value : values) {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    value = static_cast<float>(state >> 40) / static_cast<float>(1 << 23) - 1;
  }
  return values;
}

/// Wall time, and the processor time of all our threads, which other work on the machine hardly changes.
struct Seconds {
  double wall, processor;
};

Seconds seconds_of(const std::function<void()>& run) {
  const auto processor_time = [] {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  const double processor_start = processor_time();
  const auto start = std::chrono::steady_clock::now();
  run();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  return {wall.count(), processor_time() - processor_start};
}

Seconds median(const std::vector<Seconds>& runs) {
  const auto of = [&](double Seconds::*member) {
    std::vector<double> values;
    for (const Seconds& run : runs) values.push_back(run.*member);
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  };
  return {of(&Seconds::wall), of(&Seconds::processor)};
}

double relative_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference += std::pow(static_cast<double>(a[i]) - b[i], 2);
    norm += std::pow(static_cast<double>(b[i]), 2);
  }
  return std::sqrt(difference / norm);
}

/// A graph of ours with its inputs written.
struct Ours {
  std::unique_ptr<Graph> graph;
  std::unique_ptr<Executor> executor;
  Value result;
};

Ours our_convolution(Device& device, ConvolutionSize size, Direction direction,
                     const std::vector<float>& image, const std::vector<float>& weights,
                     const std::vector<float>& gradient) {
  Ours ours{std::make_unique<Graph>(), nullptr, {}};
  const Value x = ours.graph->input("x", {size.height, size.width, size.in}),
              w = ours.graph->input("w", {3, 3, size.in, size.out}),
              g = ours.graph->input("g", {size.height, size.width, size.out});
  const Value y = conv2d(x, w);
  ours.result =
      direction == Direction::forward
          ? y
          : differentiate(*ours.graph, {y}, {g}, {direction == Direction::data_gradient ? x : w})[0];
  ours.executor = std::make_unique<Executor>(device, *ours.graph, Values{ours.result, x, w, g});
  ours.executor->write(x, std::span<const float>(image));
  ours.executor->write(w, std::span<const float>(weights));
  ours.executor->write(g, std::span<const float>(gradient));
  return ours;
}

Ours our_product(Device& device, ProductSize size, const std::vector<float>& x_data,
                 const std::vector<float>& w_data) {
  Ours ours{std::make_unique<Graph>(), nullptr, {}};
  const Value x = ours.graph->input("x", {size.rows, size.in}),
              w = ours.graph->input("w", {size.in, size.out});
  ours.result = linear(x, w);
  ours.executor = std::make_unique<Executor>(device, *ours.graph, Values{ours.result});
  ours.executor->write(x, std::span<const float>(x_data));
  ours.executor->write(w, std::span<const float>(w_data));
  return ours;
}

/// Runs both in turn, prints a line and returns false when their results differ.
bool compare(Device& device, const std::string& what, double flops, Ours ours, const Peer& peer,
             int repetitions) {
  const auto run_ours = [&] {
    ours.executor->run();
    device.finish();
  };
  run_ours();
  peer.run();
  const double difference = relative_difference(ours.executor->read(ours.result), peer.result());
  std::vector<Seconds> our_times, peer_times;
  for (int i = 0; i < repetitions; ++i) {
    our_times.push_back(seconds_of(run_ours));
    peer_times.push_back(seconds_of(peer.run));
  }
  const Seconds mine = median(our_times), other = median(peer_times);
  fmt::print("{:<40} {:8.2f} {:6.0f} {:10.2f} {:6.0f} {:7.2f} {:12.2f} {:11.1e}\n", what, 1e3 * mine.wall,
             flops / mine.wall * 1e-9, 1e3 * other.wall, flops / other.wall * 1e-9, other.wall / mine.wall,
             other.processor / mine.processor, difference);
  return difference <= largest_difference;
}

}  // namespace

int main(int argc, char** argv) try {
  // Waiting threads of OpenMP would spin through the other program's turn; the setting is read when the
  // program starts.
  if (!std::getenv("OMP_WAIT_POLICY")) {
    setenv("OMP_WAIT_POLICY", "passive", 1);
    execv("/proc/self/exe", argv);
  }
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 15;
  Device device;
  fmt::print(
      "{}, {} compute units; median of {} runs; speed: ours over oneDNN, by wall and by processor time\n",
      device.info().name, device.info().compute_units, repetitions);
  fmt::print("{:<40} {:>8} {:>6} {:>10} {:>6} {:>7} {:>12} {:>11}\n", "", "ours ms", "GF/s", "oneDNN ms",
             "GF/s", "speed", "by processor", "difference");
  bool right = true;
  for (const ConvolutionSize size :
       {ConvolutionSize{128, 128, 64, 64}, {256, 256, 32, 32}, {64, 64, 256, 128}}) {
    const std::int64_t pixels = size.height * size.width;
    const std::vector<float> image = numbers(pixels * size.in), weights = numbers(9 * size.in * size.out),
                             gradient = numbers(pixels * size.out);
    const double flops = 18.0 * static_cast<double>(pixels * size.in * size.out);
    for (const auto& [direction, name] : {std::pair{Direction::forward, "forward"},
                                          {Direction::data_gradient, "data gradient"},
                                          {Direction::weight_gradient, "weight gradient"}})
      right &= compare(
          device, fmt::format("conv2d {}x{} {}->{} {}", size.height, size.width, size.in, size.out, name),
          flops, our_convolution(device, size, direction, image, weights, gradient),
          convolution(size, direction, image, weights, gradient), repetitions);
  }
  for (const ProductSize size : {ProductSize{1024, 1024, 1024}, {196608, 128, 128}}) {
    const std::vector<float> x = numbers(size.rows * size.in), w = numbers(size.in * size.out);
    right &= compare(device, fmt::format("linear {}x{}x{}", size.rows, size.in, size.out),
                     2.0 * static_cast<double>(size.rows * size.in * size.out),
                     our_product(device, size, x, w), product(size, x, w), repetitions);
  }
  if (!right) fmt::print("results differ by more than {}\n", largest_difference);
  return right ? 0 : 1;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
