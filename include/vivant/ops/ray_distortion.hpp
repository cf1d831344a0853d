#pragma once
#include "vivant/ops/rays.hpp"

namespace vivant {

/// How far the weight of each ray is spread, [R, 1]: 0 when one short interval has it all. weight as
/// render_weights gives it and depths, both [R, S], and near and far [R, 1], between which distances are
/// measured from 0 to 1 in the spacing of the samples. The distortion of Mip-NeRF 360 (Barron et al. 2022,
/// equation 15). Gradient to weight alone.
Value ray_distortion(Value weight, Value depths, Value near, Value far, Spacing spacing);

}  // namespace vivant
