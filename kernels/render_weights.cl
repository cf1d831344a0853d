// render_weights: one work-item per ray walks its samples front to back, VW at a time.
//   x_i = density_i delta_i,  w_i = T_i (1 - exp(-x_i)),  T_i = exp(-(x_0 + ... + x_{i-1}))
//   density, delta, depths [R,S]  ->  weight [R,S]  alpha [R]  depth [R]
//
// The gradient walks back to front and never divides by what a sample lets pass:
//   d w_j / d x_i = T_{i+1} for j = i, -w_j for j > i, and T_{i+1} = T_end + w_{i+1} + ... + w_{S-1}
#include "common.clh"

// `n` elements; the lanes behind them are 0.
inline REALV load_some(IN REAL* p, int n) {
  if (n >= VW) return VLOAD(0, p);
  REAL lanes[VW];
  for (int k = 0; k < VW; ++k) lanes[k] = k < n ? p[k] : 0;
  return VLOAD(0, lanes);
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
    REAL single[VW], before[VW];
    VSTORE(x, 0, single);
    UNROLL for (int k = 0; k < VW; ++k) {
      before[k] = passed;
      passed += single[k];
    }
    const REALV w = -exp(-VLOAD(0, before)) * expm1(-x);
    depth_sum += w * load_some(depths + row + s, n);
    if (n == VW) {
      VSTORE(w, 0, weight + row + s);
    } else {
      VSTORE(w, 0, single);
      for (int k = 0; k < n; ++k) weight[row + s + k] = single[k];
    }
  }
  REAL parts[VW], sum = 0;
  VSTORE(depth_sum, 0, parts);
  for (int k = 0; k < VW; ++k) sum += parts[k];
  depth[ray] = sum;
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
  REAL passed = 0;
  for (int s = 0; s < samples; ++s) passed += density[row + s] * delta[row + s];
  const REAL end = exp(-passed), by_alpha = grad_alpha ? grad_alpha[ray] * end : 0;
  REAL transmittance = end, behind = 0;  // T_{i+1}, and the sum of w_j g_j for j > i
  for (int s = samples - 1; s >= 0; --s) {
    const size_t i = row + s;
    const REAL g = (grad_weight ? grad_weight[i] : 0) + by_depth * depths[i];
    grad_density[i] = delta[i] * (g * transmittance - behind + by_alpha);
    transmittance += weight[i];
    behind += weight[i] * g;
  }
}
