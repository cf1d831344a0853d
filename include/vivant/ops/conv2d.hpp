#pragma once
#include "vivant/graph/graph.hpp"
#include "vivant/ops/elementwise.hpp"

namespace vivant {

/// What a convolution reads beyond the border of the image: nothing (the output shrinks), zeros, or the image
/// mirrored at the centres of its outermost pixels.
enum class Padding { none, zero, reflect };

std::string_view name_of(Padding padding);
/// Throws UsageError for an unknown name.
Padding padding_from(const std::string& name);

/// y = f(x * w + b), stride 1: x [H, W, CI], w [3, 3, CI, CO] or [1, 1, CI, CO], b [CO] or absent -> [H, W,
/// CO]; without padding 3x3 weights give [H-2, W-2, CO]. As in all networks this is a cross-correlation:
/// y[i,j] = sum over u, v of x[i+u-1, j+v-1] . w[u,v].
Value conv2d(Value x, Value w, Value b = {}, Padding padding = Padding::zero,
             Activation activation = Activation::none);

/// Whether conv2d with weights w [3, 3, CI, CO] (or with `transposed` its data gradient) that gives a picture
/// of this size is computed by Winograd's algorithm. It then reads pack_winograd(w) instead of
/// pack_weights(w).
bool suits_winograd(const Shape& w, bool transposed, std::int64_t height, std::int64_t width);

/// Weights [3, 3, CI, CO] transformed for Winograd's F(4x4, 3x3): [panels, 36 * CI, panel columns]. Recorded
/// once per graph and weight.
Value pack_winograd(Value w, bool transposed);

/// Makes pack_winograd return `packed` for `w` in this graph: frozen weights, packed once and for all.
void use_packed_winograd(Value w, Value packed, bool transposed);

}  // namespace vivant
