#pragma once
#include "vivant/graph/graph.hpp"
#include "vivant/ops/elementwise.hpp"

namespace vivant {

/// How the factors of a product enter it: as the device's arithmetic says (`--math`), or in fp32 in every
/// mode.
enum class Factors { by_mode, fp32 };

/// y = f(x . w + b): x [..., K], w [K, N] -> [..., N]; b is absent, [N], or [G, N], whose row g serves the
/// g-th run of rows / G rows (a term per ray for all samples of the ray). Rows may carry a device-side count.
/// `factors`: of y; gradients are by mode.
Value linear(Value x, Value w, Value b = {}, Activation activation = Activation::none,
             Factors factors = Factors::by_mode);

/// x^T . y over all rows: x [..., M], y [..., N] -> [M, N]. The weight gradient of linear.
Value outer_sum(Value x, Value y);

/// Weights [K, N] or [taps..., K, N] in the layout that the matrix kernels read: [panels, taps * K (padded,
/// see ops/tiles.hpp), panel columns]; rows beyond a device-side count become zeros. With `transposed`, the
/// weights of the data gradient. Recorded once per graph and weight, however often it is asked for. The
/// panel's width is chosen by the number of columns unless it is given.
Value pack_weights(Value w, bool transposed, std::int64_t panel = 0, Factors factors = Factors::by_mode);

/// Makes pack_weights return `packed` for `w` in this graph: frozen weights that were packed once and for
/// all.
void use_packed_weights(Value w, Value packed, bool transposed);

}  // namespace vivant
