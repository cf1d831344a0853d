#pragma once
#include <span>

#include "vivant/model/stylizer.hpp"

namespace vivant {

/// Gives psi and the decoder a start from which training is short: three units of psi (mirrored: of the
/// decoder's first layer) read the colours out of the features by least squares and every later layer hands
/// them on unchanged; that layer's other units are a randomly rotated whitening of the features. `features`
/// [n, C] are phi(F_c) and `colours` [n, 3] the image at a quarter of its resolution, at the same places.
/// Returns the read-out's mean squared error.
double start_read_out(ParameterStore& store, const Stylizer& stylizer, const Initializer& initializer,
                      std::span<const float> features, std::span<const float> colours);

}  // namespace vivant
