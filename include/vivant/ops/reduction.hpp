#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Sums over all rows: [..., C] -> [C]. Fixed order: the same bits whatever the number of threads.
Value sum_rows(Value x);
/// Sums over runs of rows / groups neighbouring rows: [..., C] -> [groups, C].
Value sum_groups(Value x, std::int64_t groups);
/// Sums over channels: [..., C] -> [..., 1].
Value sum_channels(Value x);
/// The sum of all elements, [1].
Value sum(Value x);
/// The mean of all elements, [1]. Not for values with a device-side count.
Value mean(Value x);
/// One row [C] repeated: -> `shape`, whose last extent is C. The gradient of sum_rows.
Value broadcast_row(Value row, Shape shape, Value count = {});
/// Each row repeated `times` times in turn: [..., C] -> [rows * times, C]. The gradient of sum_groups.
Value repeat_rows(Value x, std::int64_t times);
/// One value per row [..., 1] repeated over `channels`. The gradient of sum_channels.
Value broadcast_channels(Value x, std::int64_t channels);

}  // namespace vivant
