#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// How uneven planes are: the mean over all numbers of the squared differences to the neighbours to the right
/// and below, planes [P, H, W, C] -> [1]. What K-Planes (Fridovich-Keil et al. 2023, section 3.2) call total
/// variation, by the mean in place of the sum over the cells' number.
Value plane_variation(Value planes);

}  // namespace vivant
