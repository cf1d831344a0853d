// pack_weights: W [taps, K, N] -> [N / PANEL][taps * K][PANEL], zeros behind the last column.
//   TRANSPOSED: the weights of the data gradient: K and N change places and the taps come in reverse order.
#include "common.clh"
#ifndef TRANSPOSED
#define TRANSPOSED 0
#endif

KERNEL void pack_weights(IN REAL* restrict w, GLOBAL REAL* restrict packed, int taps, int k_extent, int n_extent,
                         int panel, int elements) {
  const int e = get_global_id(0);
  if (e >= elements) return;
  const int inner = taps * k_extent;
  const int column = e / (inner * panel) * panel + e % panel, row = e / panel % inner;
  const int tap = row / k_extent, k = row % k_extent;
  REAL value = 0;
  if (column < n_extent) {
#if TRANSPOSED
    value = w[((size_t)(taps - 1 - tap) * n_extent + column) * k_extent + k];
#else
    value = w[((size_t)tap * k_extent + k) * n_extent + column];
#endif
  }
  packed[e] = value;
}
