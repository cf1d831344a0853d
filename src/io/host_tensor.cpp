#include "vivant/io/host_tensor.hpp"

#include <fmt/ranges.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "vivant/runtime/error.hpp"

namespace vivant {

static_assert(std::endian::native == std::endian::little, "tensor files are little-endian");

std::size_t element_size(ElementType type) {
  switch (type) {
    case ElementType::f64:
    case ElementType::i64:
    case ElementType::u64:
      return 8;
    case ElementType::f32:
    case ElementType::i32:
    case ElementType::u32:
      return 4;
    case ElementType::f16:
    case ElementType::bf16:
    case ElementType::i16:
    case ElementType::u16:
      return 2;
    case ElementType::i8:
    case ElementType::u8:
    case ElementType::boolean:
      return 1;
  }
  fail("unknown element type {}", static_cast<int>(type));
}

std::string_view element_name(ElementType type) {
  static constexpr std::string_view names[] = {"F64", "F32", "F16", "BF16", "I64", "I32", "I16",
                                               "I8",  "U64", "U32", "U16",  "U8",  "BOOL"};
  return names[static_cast<int>(type)];
}

std::size_t element_count(std::span<const std::int64_t> shape) {
  // Every array must be addressable, so the limit leaves room for 8-byte elements.
  constexpr std::int64_t limit = std::numeric_limits<std::int64_t>::max() / 8;
  std::int64_t count = 1;
  bool empty = false;
  for (std::int64_t size : shape) {
    if (size < 0) fail("negative size {} in shape [{}]", size, fmt::join(shape, ", "));
    if (size == 0) empty = true;
    if (size > 0 && count > limit / size) fail("shape [{}] is too large", fmt::join(shape, ", "));
    if (size > 0) count *= size;
  }
  return empty ? 0 : static_cast<std::size_t>(count);
}

HostTensor::HostTensor(ElementType element_type, std::vector<std::int64_t> dimensions)
    : type(element_type),
      shape(std::move(dimensions)),
      bytes(vivant::element_count(shape) * element_size(type)) {}

namespace {

template <typename T>
void assign(HostTensor& tensor, std::span<const T> values) {
  if (values.size() != tensor.element_count()) {
    fail("{} values do not fill a tensor of {}", values.size(), tensor.describe());
  }
  if (!values.empty()) std::memcpy(tensor.bytes.data(), values.data(), values.size_bytes());
}

template <typename T, typename To>
std::vector<To> converted(const HostTensor& tensor) {
  std::vector<To> out(tensor.element_count());
  for (std::size_t i = 0; i < out.size(); ++i) {
    T value;
    std::memcpy(&value, tensor.bytes.data() + i * sizeof(T), sizeof(T));
    out[i] = static_cast<To>(value);
  }
  return out;
}

template <typename To, float (*convert)(std::uint16_t)>
std::vector<To> converted_half(const HostTensor& tensor) {
  const std::vector<std::uint16_t> bits = converted<std::uint16_t, std::uint16_t>(tensor);
  std::vector<To> out(bits.size());
  for (std::size_t i = 0; i < bits.size(); ++i) out[i] = convert(bits[i]);
  return out;
}

template <typename To>
std::vector<To> converted_to(const HostTensor& tensor) {
  switch (tensor.type) {
    case ElementType::f64:
      return converted<double, To>(tensor);
    case ElementType::f32:
      return converted<float, To>(tensor);
    case ElementType::f16:
      return converted_half<To, half_to_float>(tensor);
    case ElementType::bf16:
      return converted_half<To, bfloat16_to_float>(tensor);
    case ElementType::i64:
      return converted<std::int64_t, To>(tensor);
    case ElementType::i32:
      return converted<std::int32_t, To>(tensor);
    case ElementType::i16:
      return converted<std::int16_t, To>(tensor);
    case ElementType::i8:
      return converted<std::int8_t, To>(tensor);
    case ElementType::u64:
      return converted<std::uint64_t, To>(tensor);
    case ElementType::u32:
      return converted<std::uint32_t, To>(tensor);
    case ElementType::u16:
      return converted<std::uint16_t, To>(tensor);
    case ElementType::u8:
    case ElementType::boolean:
      return converted<std::uint8_t, To>(tensor);
  }
  fail("unknown element type {}", static_cast<int>(tensor.type));
}

}  // namespace

HostTensor::HostTensor(std::vector<std::int64_t> dimensions, std::span<const float> values)
    : HostTensor(ElementType::f32, std::move(dimensions)) {
  assign(*this, values);
}
HostTensor::HostTensor(std::vector<std::int64_t> dimensions, std::span<const double> values)
    : HostTensor(ElementType::f64, std::move(dimensions)) {
  assign(*this, values);
}
HostTensor::HostTensor(std::vector<std::int64_t> dimensions, std::span<const std::int32_t> values)
    : HostTensor(ElementType::i32, std::move(dimensions)) {
  assign(*this, values);
}
HostTensor::HostTensor(std::vector<std::int64_t> dimensions, std::span<const std::int64_t> values)
    : HostTensor(ElementType::i64, std::move(dimensions)) {
  assign(*this, values);
}
HostTensor::HostTensor(std::vector<std::int64_t> dimensions, std::span<const std::uint8_t> values)
    : HostTensor(ElementType::u8, std::move(dimensions)) {
  assign(*this, values);
}

std::size_t HostTensor::element_count() const { return bytes.size() / element_size(type); }

std::string HostTensor::describe() const {
  return fmt::format("{} [{}]", element_name(type), fmt::join(shape, ", "));
}

std::vector<float> HostTensor::as_floats() const { return converted_to<float>(*this); }
std::vector<double> HostTensor::as_doubles() const { return converted_to<double>(*this); }

std::vector<std::int64_t> HostTensor::as_ints() const {
  if (type == ElementType::f64 || type == ElementType::f32 || type == ElementType::f16 ||
      type == ElementType::bf16) {
    fail("integers are needed, the tensor is {}", describe());
  }
  std::vector<std::int64_t> values = converted_to<std::int64_t>(*this);
  if (type == ElementType::u64) {
    for (std::int64_t value : values) {
      if (value < 0) fail("a value of the tensor {} does not fit in 64 signed bits", describe());
    }
  }
  return values;
}

float half_to_float(std::uint16_t bits) {
  const int exponent = (bits >> 10) & 0x1f;
  const int mantissa = bits & 0x3ff;
  float value;
  if (exponent == 0) {
    value = std::ldexp(static_cast<float>(mantissa), -24);
  } else if (exponent == 31) {
    value = mantissa == 0 ? std::numeric_limits<float>::infinity() : std::numeric_limits<float>::quiet_NaN();
  } else {
    value = std::ldexp(static_cast<float>(mantissa + 1024), exponent - 25);
  }
  return (bits & 0x8000) ? -value : value;
}

float bfloat16_to_float(std::uint16_t bits) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(bits) << 16);
}

}  // namespace vivant
