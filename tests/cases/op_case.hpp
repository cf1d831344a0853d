#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <source_location>
#include <string>
#include <vector>

#include "vivant/graph/types.hpp"

namespace vivant::cases {

/// A tensor on the host. Every dtype is kept as double, which holds them all exactly.
struct HostTensor {
  DType dtype = DType::real;
  Shape shape;
  std::vector<double> data;
  bool absent = false;          ///< an optional input that is left out
  bool differentiable = true;   ///< gradients of this input are checked (real inputs only)
  std::int64_t live_rows = -1;  ///< with a device-side count of this many rows, or -1
};

/// A tensor without data yet, of which no gradient is asked.
HostTensor fixed_tensor(DType dtype, Shape shape);
/// The same of integers, as rows of `columns`.
HostTensor integer_rows(const std::vector<std::int32_t>& data, std::int64_t columns);

/// Numbers for inputs, the same on every run: a small linear congruential generator.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 2862933555777941757ull + 3037000493ull) {}
  double uniform(double low = 0, double high = 1);
  double normal();
  std::int64_t integer(std::int64_t end);  ///< in [0, end)
  HostTensor tensor(Shape shape, double low = -1, double high = 1);

 private:
  std::uint64_t next();
  std::uint64_t state_;
};

/// One way to run an op: extents that the case's `inputs` interprets, and attributes.
struct Variation {
  std::vector<std::int64_t> sizes;
  nlohmann::json attributes = nlohmann::json::object();
};

/// Everything that tests and benchmarks need to know of an op, once.
struct OpCase {
  std::string op;                     ///< its name in the registry
  std::vector<Variation> variations;  ///< odd shapes: 1, primes, tile +- 1
  std::function<std::vector<HostTensor>(const Variation&, Random&)>
      inputs;  ///< avoid kinks in values that are differentiated
  std::function<std::vector<HostTensor>(const Variation&, const std::vector<HostTensor>&)>
      reference;                                 ///< plain loops in double
  std::vector<Variation> for_matrix_units = {};  ///< more variations for bf16: several blocks
  double tolerance = 1e-5;  ///< |value - reference| <= tolerance * (|reference| + rms of the reference)
  double gradient_tolerance = 1e-6;  ///< the same, double kernel against central differences
  double step = 1e-5;                ///< of the central differences
  /// Whether rounding to bf16 may move values over a kink, where the gradient is another one: gradients in
  /// bf16 are not compared then.
  std::function<bool(const Variation&)> has_kinks = [](const Variation&) { return false; };
  Variation benchmark = {};  ///< a size that is met in practice
  std::function<double(const Variation&)> flops = {},
                                          bytes = {};  ///< of the forward pass; bytes that must move at least
  std::string file = {};                               ///< stem of the case file, set by Register
};

/// All cases. A file adds its own with a global `const Register registration(OpCase{...})`.
const std::vector<OpCase>& all_cases();
struct Register {
  explicit Register(OpCase op_case, std::source_location where = std::source_location::current());
};

}  // namespace vivant::cases
