#pragma once
#include <algorithm>
#include <cmath>

namespace vivant {

/// Peak signal-to-noise ratio in dB of values in [0, 1] from their mean squared error; at most 120.
inline double psnr_of(double squared_error) { return -10 * std::log10(std::max(1e-12, squared_error)); }

}  // namespace vivant
