// pack_weights: W [taps, K, N] -> [N / PANEL][panel_rows][PANEL], of which the first taps * K rows are used, zeros behind
// the last column.
//   TRANSPOSED: the weights of the data gradient: K and N change places and the taps come in reverse order.
// Where a matrix W [K, N] has a count of live rows, zeros stand for the others. One work-item per row of a panel.
#include "common.clh"
#ifndef TRANSPOSED
#define TRANSPOSED 0
#endif

KERNEL void pack_weights(IN REAL* restrict w, GLOBAL REAL* restrict packed, int taps, int k_extent, int n_extent,
                         int panel, int panel_rows, IN int* count) {
  const int row = get_global_id(0), inner = taps * k_extent, first = get_global_id(1) * panel;
  if (row >= inner || first >= n_extent) return;
  const int tap = row / k_extent, k = row % k_extent;
  GLOBAL REAL* target = packed + (size_t)first * panel_rows + (size_t)row * panel;
#if TRANSPOSED
  const int end = min(panel, live_rows(n_extent, count) - first);
  IN REAL* source = w + ((size_t)(taps - 1 - tap) * n_extent + first) * k_extent + k;
  for (int c = 0; c < end; ++c) target[c] = source[(size_t)c * k_extent];
#else
  const int end = k < live_rows(k_extent, count) ? min(panel, n_extent - first) : 0;
  IN REAL* source = w + ((size_t)tap * k_extent + k) * n_extent + first;
  for (int c = 0; c < end; ++c) target[c] = source[c];
#endif
  for (int c = max(end, 0); c < panel; ++c) target[c] = 0;
}
