#include "cases/op_case.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

namespace vivant::cases {
namespace {

std::vector<OpCase>& registered() {
  static std::vector<OpCase> cases;
  return cases;
}

}  // namespace

HostTensor fixed_tensor(DType dtype, Shape shape) {
  HostTensor tensor;
  tensor.dtype = dtype;
  tensor.shape = std::move(shape);
  tensor.differentiable = false;
  return tensor;
}

HostTensor integer_rows(const std::vector<std::int32_t>& data, std::int64_t columns) {
  HostTensor tensor = fixed_tensor(DType::i32, {static_cast<std::int64_t>(data.size()) / columns, columns});
  tensor.data.assign(data.begin(), data.end());
  return tensor;
}

std::uint64_t Random::next() {
  state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
  return state_ ^ (state_ >> 29);
}

double Random::uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53;
}

double Random::normal() {
  const double u = uniform(1e-12, 1), v = uniform();
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

std::int64_t Random::integer(std::int64_t end) {
  return std::min(end - 1, static_cast<std::int64_t>(uniform() * static_cast<double>(end)));
}

HostTensor Random::tensor(Shape shape, double low, double high) {
  HostTensor tensor;
  tensor.shape = std::move(shape);
  tensor.data.resize(tensor.shape.elements());
  for (double& x : tensor.data) x = uniform(low, high);
  return tensor;
}

const std::vector<OpCase>& all_cases() { return registered(); }

Register::Register(OpCase op_case, std::source_location where) {
  op_case.file = std::filesystem::path(where.file_name()).stem().string();
  auto& cases = registered();
  cases.insert(std::upper_bound(cases.begin(), cases.end(), op_case,
                                [](const OpCase& a, const OpCase& b) { return a.op < b.op; }),
               std::move(op_case));
}

}  // namespace vivant::cases
