#pragma once
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "vivant/runtime/error.hpp"

namespace vivant {

/// Element types. `real` is float in production; the gradient checks run the same kernels with double.
enum class DType : std::uint8_t { real, bf16, i32, u8 };

enum class Precision { single, double_ };

std::string_view name_of(DType dtype);
std::size_t element_bytes(DType dtype, Precision precision);

/// The extents of a row-major tensor, channels last. A scalar is [1].
class Shape {
 public:
  Shape() = default;
  Shape(std::initializer_list<std::int64_t> extents) : extents_(extents) {}
  explicit Shape(std::vector<std::int64_t> extents) : extents_(std::move(extents)) {}

  int rank() const { return static_cast<int>(extents_.size()); }
  /// Extent of axis i; negative i counts from the end.
  std::int64_t operator[](int i) const { return extents_[i < 0 ? extents_.size() + i : i]; }
  std::int64_t elements() const;
  /// The last extent, and the number of rows of that length: a tensor seen as a matrix [rows, channels].
  std::int64_t channels() const { return extents_.back(); }
  std::int64_t rows() const { return elements() / channels(); }
  const std::vector<std::int64_t>& extents() const { return extents_; }
  /// The same with another last extent.
  Shape with_channels(std::int64_t channels) const;
  std::string text() const;
  bool operator==(const Shape&) const = default;

 private:
  std::vector<std::int64_t> extents_;
};

struct TensorType {
  DType dtype = DType::real;
  Shape shape;
  /// Id of an i32 [1] value that says how many leading rows are alive, or -1 when all are. Only
  /// matrices [rows, channels] have one; what lies beyond the count is undefined and no op reads it.
  int count = -1;
};

using TensorTypes = std::vector<TensorType>;

}  // namespace vivant
