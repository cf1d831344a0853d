// place_rows: y[ids[n]] = x[n]; the rest of y was set to 0 before.     x [N,C]  ids [N]  -> y [rows,C]
//
//   x    a b c         ids  1 4 5        y   0 a 0 0 b c 0
//
// One work-item per row; ids are distinct, so that no two write the same place. The gradient takes the rows back.
#include "common.clh"

KERNEL void place_rows(IN REAL* restrict x, IN int* restrict ids, GLOBAL REAL* restrict y, int n, int channels,
                       IN int* count) {
  const int row = get_global_id(0);
  if (row >= live_rows(n, count) || ids[row] < 0) return;
  for (int c = 0; c < channels; ++c) y[(size_t)ids[row] * channels + c] = x[(size_t)row * channels + c];
}

KERNEL void place_rows_gradient(IN REAL* restrict grad_y, IN int* restrict ids, GLOBAL REAL* restrict grad_x, int n,
                                int channels, IN int* count) {
  const int row = get_global_id(0);
  if (row >= live_rows(n, count)) return;
  for (int c = 0; c < channels; ++c)
    grad_x[(size_t)row * channels + c] = ids[row] < 0 ? 0 : grad_y[(size_t)ids[row] * channels + c];
}
