#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// x [H, W, C] -> [height, width, C], bilinear: pixel centres at +0.5, edges clamped (as PyTorch with
/// align_corners = false). Larger or smaller; smaller takes 2 x 2 samples and does not average over more.
Value resize_bilinear(Value x, std::int64_t height, std::int64_t width);

/// The window of `height` x `width` pixels of x [H, W, C] whose first pixel is (y, x). With `replicate` it
/// may reach beyond the border, where the edge pixels are repeated.
Value crop(Value image, std::int64_t y, std::int64_t x, std::int64_t height, std::int64_t width,
           bool replicate = false);

/// x [H, W, C] convolved with a normalised Gaussian of standard deviation `sigma` pixels, cut off at radius
/// ceil(3 sigma); borders are reflected about the edge pixel's centre. H and W must exceed the radius.
Value gaussian_blur(Value x, double sigma);

}  // namespace vivant
