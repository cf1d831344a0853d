// scan: exclusive prefix sums of counts [n], in chunks of CHUNK, cut off at a capacity.
//   scan_chunks   sums [chunks]     one work-item per chunk
//   scan_sums     sums -> the chunks' starts, in place; total[0] = min(sum, capacity), overflow[0]; one work-item
//   scan_starts   starts [n + 1]    one work-item per chunk; the last is the total
#include "common.clh"

#ifndef CHUNK
#define CHUNK 256
#endif

KERNEL void scan_chunks(IN int* restrict counts, GLOBAL int* restrict sums, int n) {
  const int chunk = get_global_id(0), first = chunk * CHUNK;
  if (first >= n) return;
  int sum = 0;
  for (int i = first; i < min(first + CHUNK, n); ++i) sum += counts[i];
  sums[chunk] = sum;
}

KERNEL void scan_sums(GLOBAL int* restrict sums, GLOBAL int* restrict total, GLOBAL int* restrict overflow, int chunks,
                      int capacity) {
  if (get_global_id(0) > 0) return;
  int sum = 0;
  for (int k = 0; k < chunks; ++k) {
    const int own = sums[k];
    sums[k] = sum;
    sum += own;
  }
  total[0] = min(sum, capacity);
  overflow[0] = sum > capacity;
}

KERNEL void scan_starts(IN int* restrict counts, IN int* restrict sums, GLOBAL int* restrict starts, int n,
                        int capacity) {
  const int chunk = get_global_id(0), first = chunk * CHUNK, end = min(first + CHUNK, n);
  if (first >= n) return;
  int sum = sums[chunk];
  for (int i = first; i < end; ++i) {
    starts[i] = min(sum, capacity);
    sum += counts[i];
  }
  if (end == n) starts[n] = min(sum, capacity);
}
