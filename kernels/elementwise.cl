// elementwise: one vector of VW elements per work-item.
//   unary      y = f(x)                      f by FUNCTION: an activation, or scale * x + shift
//   slope      grad_x = grad_y * f'(x)       from y = f(x)
//   clamp      y = min(max(x, low), high), gradient 0 outside
//   binary     y = a (op) b                  b is broadcast by BROADCAST: 0 same shape, 1 one row of channels,
//                                            2 one value per row, 3 a single value
#include "activation.clh"

#ifndef OPERATION
#define OPERATION +
#endif
#ifndef BROADCAST
#define BROADCAST 0
#endif

// Elements [i, i + VW) of a tensor of n; a work-item at the end does what is left one by one.
#define FOR_VECTOR(i, n, VECTOR, SCALAR)                       \
  if (i + VW <= n) {                                           \
    VECTOR;                                                    \
  } else {                                                     \
    for (int e = i; e < n; ++e) { SCALAR; }                    \
  }

KERNEL void activation(IN REAL* restrict x, GLOBAL REAL* restrict y, int rows, int channels, IN int* count) {
  const int i = get_global_id(0) * VW, n = live_rows(rows, count) * channels;
  FOR_VECTOR(i, n, VSTORE(ACTIVATE(REALV, VLOAD(0, x + i)), 0, y + i), y[e] = ACTIVATE(REAL, x[e]))
}

KERNEL void activation_gradient(IN REAL* restrict y, IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x, int rows,
                                int channels, IN int* count) {
  const int i = get_global_id(0) * VW, n = live_rows(rows, count) * channels;
  FOR_VECTOR(i, n, VSTORE(VLOAD(0, grad_y + i) * SLOPE(REALV, VLOAD(0, y + i)), 0, grad_x + i),
             grad_x[e] = grad_y[e] * SLOPE(REAL, y[e]))
}

KERNEL void affine(IN REAL* restrict x, GLOBAL REAL* restrict y, REAL scale, REAL shift, int rows, int channels,
                   IN int* count) {
  const int i = get_global_id(0) * VW, n = live_rows(rows, count) * channels;
  FOR_VECTOR(i, n, VSTORE(VLOAD(0, x + i) * scale + shift, 0, y + i), y[e] = x[e] * scale + shift)
}

// `clamp` itself is the built-in function.
KERNEL void clamp_range(IN REAL* restrict x, GLOBAL REAL* restrict y, REAL low, REAL high, int rows, int channels,
                        IN int* count) {
  const int i = get_global_id(0) * VW, n = live_rows(rows, count) * channels;
  FOR_VECTOR(i, n, VSTORE(clamp(VLOAD(0, x + i), low, high), 0, y + i), y[e] = clamp(x[e], low, high))
}

KERNEL void clamp_gradient(IN REAL* restrict x, IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x, REAL low,
                           REAL high, int rows, int channels, IN int* count) {
  const int i = get_global_id(0) * VW, n = live_rows(rows, count) * channels;
  for (int e = i; e < min(i + VW, n); ++e) grad_x[e] = x[e] >= low && x[e] <= high ? grad_y[e] : 0;
}

KERNEL void binary(IN REAL* restrict a, IN REAL* restrict b, GLOBAL REAL* restrict y, int rows, int channels,
                   IN int* count) {
  const int i = get_global_id(0) * VW, n = live_rows(rows, count) * channels;
#if BROADCAST == 0
  FOR_VECTOR(i, n, VSTORE(VLOAD(0, a + i) OPERATION VLOAD(0, b + i), 0, y + i), y[e] = a[e] OPERATION b[e])
#elif BROADCAST == 1
  for (int e = i; e < min(i + VW, n); ++e) y[e] = a[e] OPERATION b[e % channels];
#elif BROADCAST == 2
  for (int e = i; e < min(i + VW, n); ++e) y[e] = a[e] OPERATION b[e / channels];
#else
  const REAL single = b[0];
  FOR_VECTOR(i, n, VSTORE(VLOAD(0, a + i) OPERATION single, 0, y + i), y[e] = a[e] OPERATION single)
#endif
}
