// render_weights: one work-item per ray walks its samples front to back, VW at a time.
//   x_i = density_i delta_i,  w_i = T_i (1 - exp(-x_i)),  T_i = exp(-(x_0 + ... + x_{i-1}))
//   density, delta, depths [R,S]  ->  weight [R,S]  alpha [R]  depth [R]
//
// The gradient walks back to front and never divides by what a sample lets pass:
//   d w_j / d x_i = T_{i+1} for j = i, -w_j for j > i, and T_{i+1} = T_end + w_{i+1} + ... + w_{S-1}
#include "running_sums.clh"

// `n` elements; the lanes behind them are 0.
INLINE REALV load_some(IN REAL* p, int n) {
  if (n >= VW) return VLOAD(0, p);
  REAL lanes[VW];
  for (int k = 0; k < VW; ++k) lanes[k] = k < n ? p[k] : 0;
  return VLOAD(0, lanes);
}
INLINE void store_some(REALV x, GLOBAL REAL* p, int n) {
  if (n >= VW) {
    VSTORE(x, 0, p);
    return;
  }
  REAL lanes[VW];
  VSTORE(x, 0, lanes);
  for (int k = 0; k < n; ++k) p[k] = lanes[k];
}

KERNEL void render_weights(IN REAL* restrict density, IN REAL* restrict delta, IN REAL* restrict depths,
                           GLOBAL REAL* restrict weight, GLOBAL REAL* restrict alpha, GLOBAL REAL* restrict depth,
                           int rays, int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  const size_t row = (size_t)ray * samples;
  REAL passed = 0;  // the sum of x so far
  REALV depth_sum = (REALV)(0);
  for (int s = 0; s < samples; s += VW) {
    const int n = min(VW, samples - s);
    const REALV x = load_some(density + row + s, n) * load_some(delta + row + s, n);
    // One after the other, not by running sums: empty samples of another field in between then change no bit.
    REAL single[VW], before[VW];
    VSTORE(x, 0, single);
    UNROLL for (int k = 0; k < VW; ++k) {
      before[k] = passed;
      passed += single[k];
    }
    const REALV w = -exp(-VLOAD(0, before)) * expm1(-x);
    depth_sum += w * load_some(depths + row + s, n);
    store_some(w, weight + row + s, n);
  }
  depth[ray] = LAST(sums_up_to(depth_sum));
  alpha[ray] = -expm1(-passed);
}

// Each of the three output gradients may be absent.
KERNEL void render_weights_gradient(IN REAL* restrict density, IN REAL* restrict delta, IN REAL* restrict depths,
                                    IN REAL* restrict weight, IN REAL* restrict grad_weight,
                                    IN REAL* restrict grad_alpha, IN REAL* restrict grad_depth,
                                    GLOBAL REAL* restrict grad_density, int rays, int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  const size_t row = (size_t)ray * samples;
  const REAL by_depth = grad_depth ? grad_depth[ray] : 0;
  REALV passed = (REALV)(0);
  for (int s = 0; s < samples; s += VW) {
    const int n = min(VW, samples - s);
    passed += load_some(density + row + s, n) * load_some(delta + row + s, n);
  }
  const REAL end = exp(-LAST(sums_up_to(passed))), by_alpha = grad_alpha ? grad_alpha[ray] * end : 0;
  REAL transmittance = end, behind = 0;  // behind the vector: T, and the sum of w_j g_j
  for (int s = (samples - 1) / VW * VW; s >= 0; s -= VW) {
    const int n = min(VW, samples - s);
    const size_t i = row + s;
    REALV g = (REALV)(0);
    if (grad_weight) g = load_some(grad_weight + i, n);
    if (grad_depth) g += by_depth * load_some(depths + i, n);
    const REALV w = load_some(weight + i, n), weights = sums_from(w), shares = sums_from(w * g);
    const REALV passing = transmittance + DOWN(1, weights), taken_behind = behind + DOWN(1, shares);
    store_some(load_some(delta + i, n) * (g * passing - taken_behind + by_alpha), grad_density + i, n);
    transmittance += weights.s0;
    behind += shares.s0;
  }
}
