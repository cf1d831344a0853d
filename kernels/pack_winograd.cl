// pack_winograd: W [3, 3, K, N] -> [N / PANEL][36][K][PANEL], Winograd's transformed weights, zeros behind the last column.
//   TRANSPOSED: those of the data gradient: K and N change places and the taps come in reverse order.
// One work-item per input channel and panel.
#include "common.clh"
#include "winograd.clh"
#ifndef TRANSPOSED
#define TRANSPOSED 0
#endif

KERNEL void pack_winograd(IN REAL* restrict w, GLOBAL REAL* restrict packed, int k_extent, int n_extent, int panel) {
  const int k = get_global_id(0), first = get_global_id(1) * panel;
  if (k >= k_extent || first >= n_extent) return;
  GLOBAL REAL* target = packed + (size_t)first * 36 * k_extent + (size_t)k * panel;
  for (int c = 0; c < panel; c += VW) {
    REALV taps[9], half_way[3 * 6], points[6];
    UNROLL for (int tap = 0; tap < 9; ++tap) {
      REAL lanes[VW];
      for (int i = 0; i < VW; ++i) {
        const int n = first + c + i;
#if TRANSPOSED
        lanes[i] = n < n_extent ? w[((size_t)(8 - tap) * n_extent + n) * k_extent + k] : 0;
#else
        lanes[i] = n < n_extent ? w[((size_t)tap * k_extent + k) * n_extent + n] : 0;
#endif
      }
      taps[tap] = VLOAD(0, lanes);
    }
    UNROLL for (int i = 0; i < 3; ++i) WEIGHT_TRANSFORM(REALV, taps + i, 3, half_way + i, 3)
    UNROLL for (int i = 0; i < 6; ++i) {
      WEIGHT_TRANSFORM(REALV, half_way + 3 * i, 1, points, 1)
      UNROLL for (int j = 0; j < 6; ++j)
          VSTORE(points[j], 0, target + (size_t)(6 * i + j) * k_extent * panel + c);
    }
  }
}
