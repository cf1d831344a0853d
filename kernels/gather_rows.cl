// gather_rows: y [K,C] = x [ids [K], C], and its transpose scatter_rows, which sums the rows of each id.
//
//   ids     2  0  2 -1         gather:  y_k = x[ids_k]         scatter:  y_n = sum of x_k with ids_k = n, k ascending
//
// The sum has two forms. With ascending ids a row finds its own by bisection. With ids in any order, a few work-items
// fill a private copy each with their share of the ids, and the copies are added in order.
#include "lanes.clh"

KERNEL void gather_rows(IN REAL* restrict x, IN int* restrict ids, GLOBAL REAL* restrict y, int capacity, int block,
                        IN int* count) {
  const int first_vector = get_global_id(0) * VECTORS_PER_ITEM, first = get_global_id(1) * block;
  const int end = min(first + block, live_rows(capacity, count));
  if (first_vector >= VECTORS) return;
  for (int k = first; k < end; ++k) {
    const int id = ids[k];
    IN REAL* row = x + (size_t)max(id, 0) * CHANNELS;
    UNROLL for (int v = first_vector; v < first_vector + VECTORS_PER_ITEM; ++v)
      STORE(id < 0 ? (LANE)(0) : LOAD(row + v * LANES), y + (size_t)k * CHANNELS + v * LANES);
  }
}

// The first of `n` ascending ids that is at least `id`; negative ids stand last.
inline int first_of(IN int* ids, int n, int id) {
  int low = 0, high = n;
  while (low < high) {
    const int middle = (low + high) / 2;
    if ((uint)ids[middle] < (uint)id)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

KERNEL void scatter_ascending(IN REAL* restrict x, IN int* restrict ids, GLOBAL REAL* restrict y, int rows,
                              int capacity, int block, IN int* count) {
  const int first_vector = get_global_id(0) * VECTORS_PER_ITEM, first = get_global_id(1) * block;
  const int end = min(first + block, rows), n = live_rows(capacity, count);
  if (first_vector >= VECTORS || first >= rows) return;
  int k = first_of(ids, n, first);
  for (int row = first; row < end; ++row) {
    LANE sum[VECTORS_PER_ITEM];
    UNROLL for (int v = 0; v < VECTORS_PER_ITEM; ++v) sum[v] = (LANE)(0);
    for (; k < n && ids[k] == row; ++k) {
      UNROLL for (int v = 0; v < VECTORS_PER_ITEM; ++v)
        sum[v] += LOAD(x + (size_t)k * CHANNELS + (first_vector + v) * LANES);
    }
    UNROLL for (int v = 0; v < VECTORS_PER_ITEM; ++v)
      STORE(sum[v], y + (size_t)row * CHANNELS + (first_vector + v) * LANES);
  }
}

// partial [partitions,rows,C]; one work-item per vector of channels and partition.
KERNEL void scatter_any(IN REAL* restrict x, IN int* restrict ids, GLOBAL REAL* restrict partial, int rows,
                        int capacity, int share, int partitions, IN int* count) {
  const int v = get_global_id(0), partition = get_global_id(1);
  if (v >= VECTORS || partition >= partitions) return;
  GLOBAL REAL* sums = partial + (size_t)partition * rows * CHANNELS + v * LANES;
  for (int row = 0; row < rows; ++row) STORE((LANE)(0), sums + (size_t)row * CHANNELS);
  const int first = partition * share, end = min(first + share, live_rows(capacity, count));
  for (int k = first; k < end; ++k) {
    if (ids[k] < 0) continue;
    GLOBAL REAL* target = sums + (size_t)ids[k] * CHANNELS;
    STORE(LOAD(target) + LOAD(x + (size_t)k * CHANNELS + v * LANES), target);
  }
}
