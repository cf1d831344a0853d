// The arithmetic of matrix products: which one runs, on what, and that the units compute what they should.
// The ops themselves are compared with their references by `op_cases --math`.
#include "vivant/runtime/arithmetic.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "environment.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/ops/linear.hpp"

using namespace vivant;

namespace {

DeviceOptions in_math(const std::string& math, const std::string& device_class = "cpu") {
  DeviceOptions options;
  options.device_class = device_class;
  options.math = math;
  return options;
}

}  // namespace

TEST_CASE("arithmetic: the best that the units are good for") {
  const ScopedVariable no_units("VIVANT_MATRIX_UNITS", ""), no_math("VIVANT_MATH", "");
  CHECK(choose_math("", MatrixUnits::none) == Math::fp32);
  CHECK(choose_math("", MatrixUnits::dot) == Math::fp32);
  CHECK(choose_math("", MatrixUnits::amx) == Math::bf16x3);
  CHECK(choose_math("bf16x3", MatrixUnits::none) == Math::fp32);
  CHECK(choose_math("bf16", MatrixUnits::none) == Math::fp32);
  CHECK(choose_math("bf16", MatrixUnits::dot) == Math::bf16);
  CHECK(choose_math("bf16x3", MatrixUnits::dot) == Math::fp32);  // slower than fp32
  CHECK(choose_math("fp32", MatrixUnits::amx) == Math::fp32);
  const ScopedVariable asked("VIVANT_MATH", "bf16"), dot("VIVANT_MATRIX_UNITS", "dot");
  CHECK(choose_math("", MatrixUnits::amx) == Math::bf16);
  CHECK(choose_math("fp32", MatrixUnits::amx) == Math::fp32);
  CHECK(choose_math("bf16x3", MatrixUnits::dot) == Math::bf16x3);
  CHECK_THROWS_AS(choose_math("fp16", MatrixUnits::amx), UsageError);
}

TEST_CASE("arithmetic: the environment chooses the units, GPUs have none") {
  {
    const ScopedVariable none("VIVANT_MATRIX_UNITS", "none");
    CHECK(Device(in_math("bf16")).math() == Math::fp32);
  }
  {
    const ScopedVariable imitated("VIVANT_MATRIX_UNITS", "imitated");
    CHECK(Device(in_math("bf16")).math() == Math::bf16);
    CHECK(Device(in_math("bf16")).matrix_units() == MatrixUnits::imitated);
    CHECK(Device(in_math("bf16", "gpu")).math() == Math::fp32);
  }
  const ScopedVariable unknown("VIVANT_MATRIX_UNITS", "abacus");
  CHECK_THROWS_AS(Device(in_math("bf16")), UsageError);
}

TEST_CASE("arithmetic: dot products are chosen on AMD's processors alone, where they are fast") {
  const ScopedVariable no_units("VIVANT_MATRIX_UNITS", "");
  std::ifstream file("/proc/cpuinfo");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const auto has = [&](const char* flag) { return text.find(flag) != std::string::npos; };
  if (!has("avx512_bf16") || has("amx_bf16")) {
    MESSAGE("this processor has no dot products, or tiles as well");
    return;
  }
  CHECK(find_matrix_units() == (has("AuthenticAMD") ? MatrixUnits::dot : MatrixUnits::none));
}

TEST_CASE("arithmetic: products of integers are exact on every kind of unit") {
  for (const std::string name : {"imitated", "dot", "amx"}) {
    const ScopedVariable units("VIVANT_MATRIX_UNITS", name);
    Device device(in_math("bf16x3"));
    if (name_of(device.matrix_units()) != name) {
      MESSAGE("this processor has no " << name << " units");
      continue;
    }
    CAPTURE(name);
    CHECK(device.wrong_products() == 0);
  }
}

TEST_CASE("arithmetic: an executor in double computes in double, whatever the mode") {
  const ScopedVariable imitated("VIVANT_MATRIX_UNITS", "imitated");
  Device device(in_math("bf16"));
  Graph graph;
  const std::vector<double> third(32, 1.0 / 3);
  const Value x = graph.constant({1, 32}, std::span<const double>(third));
  const Value y = linear(x, graph.constant({32, 1}, std::span<const double>(third)));
  const auto error = [&](Precision precision) {
    ExecutorOptions options;
    options.precision = precision;
    Executor executor(device, graph, {y}, options);
    executor.run();
    return std::abs(executor.read_doubles(y)[0] - 32.0 / 9);
  };
  CHECK(error(Precision::double_) < 1e-14);
  CHECK(error(Precision::single) > 1e-3);  // 1/3 in bf16 is off by 0.1 %
  CHECK(error(Precision::single) < 1e-1);
}

TEST_CASE("arithmetic: products asked for in fp32 are, beside the same weights in bf16") {
  const ScopedVariable imitated("VIVANT_MATRIX_UNITS", "imitated");
  Device device(in_math("bf16"));
  Graph graph;
  const std::vector<double> third(32, 1.0 / 3);
  const Value x = graph.constant({1, 32}, std::span<const double>(third)),
              w = graph.constant({32, 1}, std::span<const double>(third));
  const Value rounded = linear(x, w), exact = linear(x, w, {}, Activation::none, Factors::fp32);
  Executor executor(device, graph, {rounded, exact});
  executor.run();
  CHECK(std::abs(executor.read_doubles(rounded)[0] - 32.0 / 9) > 1e-3);
  CHECK(std::abs(executor.read_doubles(exact)[0] - 32.0 / 9) < 1e-5);
}
