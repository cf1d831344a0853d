// scatter_rows: y [rows, C] = 0, then y[ids[k]] = x[k]; gather_rows is its gradient. One element per work-item.
#include "common.clh"

KERNEL void scatter_rows(IN REAL* restrict x, IN int* restrict ids, GLOBAL REAL* restrict y, int capacity, int channels,
                         IN int* count) {
  const int e = get_global_id(0), k = e / channels;
  if (k < live_rows(capacity, count) && ids[k] >= 0) y[(size_t)ids[k] * channels + e % channels] = x[e];
}

KERNEL void gather_rows(IN REAL* restrict y, IN int* restrict ids, GLOBAL REAL* restrict x, int capacity, int channels,
                        IN int* count) {
  const int e = get_global_id(0), k = e / channels;
  if (k < live_rows(capacity, count)) x[e] = ids[k] >= 0 ? y[(size_t)ids[k] * channels + e % channels] : 0;
}
