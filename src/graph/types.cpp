#include "vivant/graph/types.hpp"

#include <fmt/ranges.h>

namespace vivant {

std::string_view name_of(DType dtype) {
  switch (dtype) {
    case DType::real:
      return "f32";
    case DType::bf16:
      return "bf16";
    case DType::i32:
      return "i32";
    case DType::u8:
      return "u8";
  }
  return "?";
}

std::size_t element_bytes(DType dtype, Precision precision) {
  switch (dtype) {
    case DType::real:
      return precision == Precision::single ? 4 : 8;
    case DType::bf16:
      return 2;
    case DType::i32:
      return 4;
    case DType::u8:
      return 1;
  }
  return 0;
}

std::int64_t Shape::elements() const {
  std::int64_t product = 1;
  for (std::int64_t extent : extents_) product *= extent;
  return product;
}

Shape Shape::with_channels(std::int64_t channels) const {
  Shape other = *this;
  other.extents_.back() = channels;
  return other;
}

std::string Shape::text() const { return fmt::format("[{}]", fmt::join(extents_, ", ")); }

}  // namespace vivant
