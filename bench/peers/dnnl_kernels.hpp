#pragma once
#include <cstdint>
#include <functional>
#include <vector>

namespace vivant::peers {

/// 3x3 convolution with zero padding and stride 1 of an image [height, width, in], and its two gradients.
struct ConvolutionSize {
  std::int64_t height, width, in, out;
};
/// x [rows, in] . w [in, out].
struct ProductSize {
  std::int64_t rows, in, out;
};
enum class Direction { forward, data_gradient, weight_gradient };

/// A prepared primitive of oneDNN: fp32, images and matrices channels last, weights in the layout it prefers.
struct Peer {
  std::function<void()> run;
  std::function<std::vector<float>()> result;  ///< after a run, in our layouts: HWC, HWIO
};

/// The direct algorithm (no Winograd). `image` [H, W, in] and `weights` [3, 3, in, out] feed the forward
/// pass, `gradient` [H, W, out] the others.
Peer convolution(ConvolutionSize size, Direction direction, const std::vector<float>& image,
                 const std::vector<float>& weights, const std::vector<float>& gradient);
Peer product(ProductSize size, const std::vector<float>& x, const std::vector<float>& w);

}  // namespace vivant::peers
