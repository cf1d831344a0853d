#pragma once
#include <string>

#include "vivant/graph/graph.hpp"

namespace vivant {

/// How the three planes' samples of a point become one feature.
enum class Combine { product, sum };

/// "product" or "sum"; throws UsageError for another name.
Combine combine_from(const std::string& name);

/// Samples three feature planes at points: f(x) = P_p bilinear(plane_p, projection_p(x)), the Hadamard
/// product P of the samples (the paper) or their sum.
///
/// planes [3, H, W, C], in the order xy (column x, row y), xz (column x, row z), yz (column y, row z); points
/// [N, 3] in [-1, 1]^3, with or without a device-side count of rows; result [N, C]. A coordinate a lies at
/// column (a + 1) / 2 * W - 0.5 (pixel centres), rows alike, clamped to the border.
///
/// Gradients to planes and points. On CPUs the planes' gradient is summed in `partitions` private copies,
/// each over its own share of the points, sorted by blocks of space, which are then added in order: the bits
/// depend on that number and not on the number of threads.
Value triplane_sample(Value planes, Value points, Combine combine = Combine::product, int partitions = 2);

}  // namespace vivant
