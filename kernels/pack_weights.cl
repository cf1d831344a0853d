// pack_weights: W [taps, K, N] -> [N / PANEL][panel_rows][PANEL], of which the first taps * K rows are used, zeros behind
// the last row and the last column.
//   pack_weights_bf16: for the products of matrix_units.clh, [N / PANEL][hi, lo][taps][pairs of K][PANEL].
//   TRANSPOSED: the weights of the data gradient: K and N change places and the taps come in reverse order.
// Where a matrix W [K, N] has a count of live rows, zeros stand for the others. One work-item per row of a panel.
#include "common.clh"
#include "matrix_units.clh"
#ifndef TRANSPOSED
#define TRANSPOSED 0
#endif

KERNEL void pack_weights(IN REAL* restrict w, GLOBAL REAL* restrict packed, int taps, int k_extent, int n_extent,
                         int panel, int panel_rows, IN int* count) {
  // Axis 0 is panels, so that a row of W is read in one go; transposed it is rows, which then are neighbours in W.
  const int row = get_global_id(!TRANSPOSED), inner = taps * k_extent, first = get_global_id(TRANSPOSED) * panel;
  if (row >= panel_rows || first >= n_extent) return;
  const int tap = row / k_extent, k = row % k_extent, exists = row < inner;
  GLOBAL REAL* target = packed + (size_t)first * panel_rows + (size_t)row * panel;
#if TRANSPOSED
  const int end = exists ? min(panel, live_rows(n_extent, count) - first) : 0;
  IN REAL* source = w + ((size_t)(taps - 1 - tap) * n_extent + first) * k_extent + k;
  for (int c = 0; c < end; ++c) target[c] = source[(size_t)c * k_extent];
#else
  const int end = exists && k < live_rows(k_extent, count) ? min(panel, n_extent - first) : 0;
  IN REAL* source = w + ((size_t)tap * k_extent + k) * n_extent + first;
  for (int c = 0; c < end; ++c) target[c] = source[c];
#endif
  for (int c = max(end, 0); c < panel; ++c) target[c] = 0;
}

#if MATRIX_UNITS
// 16 columns of row k of a tap, zeros where there is none.
INLINE float16 sixteen_weights(IN float* w, int tap, int k, int n, int taps, int k_extent, int n_extent, int live) {
#if TRANSPOSED
  float values[16];
  IN float* source = w + (size_t)(taps - 1 - tap) * n_extent * k_extent + k;
  for (int i = 0; i < 16; ++i) values[i] = k < k_extent && n + i < live ? source[(size_t)(n + i) * k_extent] : 0;
  return vload16(0, values);
#else
  IN float* row = w + ((size_t)tap * k_extent + k) * n_extent;
  return k >= live ? (float16)(0) : n + 16 <= n_extent ? vload16(0, row + n) : sixteen_partial(row, n, n_extent);
#endif
}

// One work-item per pair of rows of a panel.
KERNEL void pack_weights_bf16(IN float* restrict w, GLOBAL uint* restrict packed, int taps, int k_extent, int n_extent,
                              int panel, IN int* count) {
  const int row = get_global_id(0), pairs = PAIRS_OF(k_extent), first = get_global_id(1) * panel;
  if (row >= taps * pairs || first >= n_extent) return;
  const int tap = row / pairs, k = row % pairs * 2, live = live_rows(TRANSPOSED ? n_extent : k_extent, count);
  GLOBAL uint* hi = packed + (size_t)first * taps * pairs * 2 + (size_t)row * panel;
  GLOBAL uint* lo = hi + (size_t)taps * pairs * panel;
  for (int c = 0; c < panel; c += 16) {
    uint16 upper, rest;
    split_pairs(sixteen_weights(w, tap, k, first + c, taps, k_extent, n_extent, live),
                sixteen_weights(w, tap, k + 1, first + c, taps, k_extent, n_extent, live), &upper, &rest);
    vstore16(upper, 0, hi + c);
    vstore16(rest, 0, lo + c);
  }
}
#endif
