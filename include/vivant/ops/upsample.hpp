#pragma once
#include <string>

#include "vivant/graph/graph.hpp"

namespace vivant {

/// Nearest repeats every pixel; bilinear has pixel centres at +0.5 and clamps at the border (as PyTorch with
/// align_corners = false).
enum class Upsampling { nearest, bilinear };

/// Throws UsageError for an unknown name.
Upsampling upsampling_from(const std::string& name);

/// x [H, W, C] -> [2H, 2W, C].
Value upsample2x(Value x, Upsampling upsampling);

/// x [H, W, 4C] -> [2H, 2W, C]: the channels of a pixel become a 2x2 block, y[2i+u, 2j+v, c] = x[i, j, (2u+v)
/// C + c].
Value depth_to_space(Value x);

/// The transposed 2x2 convolution of stride 2: x [H, W, CI], w [2, 2, CI, CO], b [CO] or absent -> [2H, 2W,
/// CO], y[2i+u, 2j+v] = x[i, j] . w[u, v] + b.
Value transposed_conv2d(Value x, Value w, Value b = {});

}  // namespace vivant
