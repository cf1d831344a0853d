#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// What is known of the order of row ids. `ascending` (equal ids allowed, negative ones last: what `compact`
/// gives) makes sums over rows of the same id faster.
enum class IdOrder { any, ascending };

/// Rows of a matrix: x [N, C], ids i32 [K] or [K, 1] in [0, N) -> [K, C]. A negative id gives zeros. A
/// device-side count of the ids passes on. The gradient is scatter_rows.
Value gather_rows(Value x, Value ids, IdOrder order = IdOrder::any);

/// Sums rows of the same id, in a fixed order: x [K, C], ids i32 [K] or [K, 1] in [0, rows) -> [rows, C],
/// zeros where no id points; rows with a negative id are left out. x may carry a device-side count.
/// The gradient is gather_rows.
Value scatter_rows(Value x, Value ids, std::int64_t rows, IdOrder order = IdOrder::any);

/// Colours in [0, 1] of pixels: images u8 [F, H, W, C] or [pixels, C], pixel ids i32 [R] or [R, 1] (see
/// ray_generation) -> [R, C]; zeros for a negative id. No gradient: images are data.
Value image_gather(Value images, Value pixels);

}  // namespace vivant
