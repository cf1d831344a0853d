#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// gamma(x) = (x, sin(2^l pi x), cos(2^l pi x)), l = 0..L-1: x [N, D] -> [N, D (1 + 2 L)],
/// group by group with all D coordinates in each. Rows may carry a device-side count.
Value positional_encoding(Value x, int frequencies);

}  // namespace vivant
