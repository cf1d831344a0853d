// positional_encoding: y = gamma(x), x [N, D] -> y [N, D (1 + 2 L)], in the order
//   x, sin(pi x), cos(pi x), sin(2 pi x), cos(2 pi x), ..., sin(2^(L-1) pi x), cos(2^(L-1) pi x)
// with all D coordinates in each group. One work-item per row.
#include "common.clh"

KERNEL void positional_encoding(IN REAL* restrict x, GLOBAL REAL* restrict y, int capacity, int dimensions,
                                int frequencies, IN int* count) {
  const int row = get_global_id(0);
  if (row >= live_rows(capacity, count)) return;
  GLOBAL REAL* out = y + (size_t)row * dimensions * (1 + 2 * frequencies);
  for (int d = 0; d < dimensions; ++d) {
    const REAL value = x[(size_t)row * dimensions + d];
    out[d] = value;
    REAL scaled = value;  // in half turns: sinpi keeps its accuracy at high octaves
    for (int l = 0; l < frequencies; ++l, scaled *= 2) {
      out[(1 + 2 * l) * dimensions + d] = sinpi(scaled);
      out[(2 + 2 * l) * dimensions + d] = cospi(scaled);
    }
  }
}

KERNEL void positional_encoding_gradient(IN REAL* restrict x, IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x,
                                         int capacity, int dimensions, int frequencies, IN int* count) {
  const int row = get_global_id(0);
  if (row >= live_rows(capacity, count)) return;
  IN REAL* g = grad_y + (size_t)row * dimensions * (1 + 2 * frequencies);
  for (int d = 0; d < dimensions; ++d) {
    REAL sum = g[d], scaled = x[(size_t)row * dimensions + d], slope = (REAL)(3.14159265358979323846);
    for (int l = 0; l < frequencies; ++l, scaled *= 2, slope *= 2)
      sum += slope * (cospi(scaled) * g[(1 + 2 * l) * dimensions + d] -
                      sinpi(scaled) * g[(2 + 2 * l) * dimensions + d]);
    grad_x[(size_t)row * dimensions + d] = sum;
  }
}
