#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Joins tensors along the channels: [..., C1], [..., C2], ... -> [..., C1 + C2 + ...]. Their other extents
/// and their device-side counts must be equal.
Value concat(const Values& parts);

/// The range [first, first + extent) of one axis; negative axes count from the end, so -1 means channels. A
/// copy. A device-side count of rows passes on, but the first axis of such a tensor cannot be sliced.
Value slice(Value x, int axis, std::int64_t first, std::int64_t extent);

}  // namespace vivant
