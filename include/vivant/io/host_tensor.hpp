#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vivant {

/// The element types of tensor files.
enum class ElementType { f64, f32, f16, bf16, i64, i32, i16, i8, u64, u32, u16, u8, boolean };

/// Bytes of one element.
std::size_t element_size(ElementType type);
/// The name that safetensors headers use: "F32", "BF16", "BOOL", ...
std::string_view element_name(ElementType type);

/// A dense row-major array in host memory, as files hold it. `bytes` are little-endian.
struct HostTensor {
  ElementType type = ElementType::f32;
  std::vector<std::int64_t> shape;
  std::vector<std::byte> bytes;

  HostTensor() = default;
  /// An array of zeros.
  HostTensor(ElementType type, std::vector<std::int64_t> shape);
  /// Copies `values`; their number must be the product of `shape`.
  HostTensor(std::vector<std::int64_t> shape, std::span<const float> values);
  HostTensor(std::vector<std::int64_t> shape, std::span<const double> values);
  HostTensor(std::vector<std::int64_t> shape, std::span<const std::int32_t> values);
  HostTensor(std::vector<std::int64_t> shape, std::span<const std::int64_t> values);
  HostTensor(std::vector<std::int64_t> shape, std::span<const std::uint8_t> values);

  std::size_t element_count() const;
  /// "F32 [3, 4]", for messages.
  std::string describe() const;

  /// The values converted to float or double, from any element type.
  std::vector<float> as_floats() const;
  std::vector<double> as_doubles() const;
  /// The values of an integer or boolean array; throws Error for a floating-point array or a value that does
  /// not fit.
  std::vector<std::int64_t> as_ints() const;
};

/// Product of the dimensions; throws Error when one is negative or the product overflows.
std::size_t element_count(std::span<const std::int64_t> shape);

/// Half-precision and bfloat16 bit patterns to float (exact).
float half_to_float(std::uint16_t bits);
float bfloat16_to_float(std::uint16_t bits);

}  // namespace vivant
