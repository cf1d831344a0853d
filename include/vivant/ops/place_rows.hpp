#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Rows at their places in a larger tensor: y[ids[n]] = x[n], 0 elsewhere. x [N, C], with or without a
/// device-side count; ids i32 [N], distinct and in [0, rows), negative for rows to leave out -> [rows, C].
/// The inverse of taking the samples that `compact` lists.
Value place_rows(Value x, Value ids, std::int64_t rows);

}  // namespace vivant
