// compact: the indices of the elements above a threshold, in order, by a prefix sum over chunks of CHUNK elements.
//   count_chunks   weight [n] -> counts [chunks]      one work-item per chunk
//   scan_chunks    counts -> offsets, in place; writes the total and whether it exceeds the capacity; one work-item
//   write_ids      ids and rows [capacity], rows = ids / channels; -1 behind the last; one work-item per chunk
#include "common.clh"
#ifndef CHUNK
#define CHUNK 1024
#endif

KERNEL void count_chunks(IN REAL* restrict weight, GLOBAL int* restrict counts, int n, REAL threshold) {
  const int chunk = get_global_id(0), first = chunk * CHUNK;
  if (first >= n) return;
  int count = 0;
  for (int i = first; i < min(first + CHUNK, n); ++i) count += weight[i] > threshold;
  counts[chunk] = count;
}

KERNEL void scan_chunks(GLOBAL int* restrict counts, GLOBAL int* restrict count, GLOBAL int* restrict overflow,
                        int chunks, int capacity) {
  if (get_global_id(0) > 0) return;
  int total = 0;
  for (int k = 0; k < chunks; ++k) {
    const int own = counts[k];
    counts[k] = total;
    total += own;
  }
  count[0] = min(total, capacity);
  overflow[0] = total > capacity;
}

KERNEL void write_ids(IN REAL* restrict weight, IN int* restrict offsets, IN int* restrict count,
                      GLOBAL int* restrict ids, GLOBAL int* restrict rows, int n, int channels, int capacity,
                      int chunks, REAL threshold) {
  const int chunk = get_global_id(0), first = chunk * CHUNK;
  if (chunk >= chunks) return;
  int at = offsets[chunk];
  for (int i = first; i < min(first + CHUNK, n) && at < capacity; ++i)
    if (weight[i] > threshold) {
      rows[at] = i / channels;
      ids[at++] = i;
    }
  // Each chunk clears its share of what lies behind the last index.
  const int share = (capacity + chunks - 1) / chunks;
  for (int k = max(chunk * share, count[0]); k < min((chunk + 1) * share, capacity); ++k) ids[k] = rows[k] = -1;
}
