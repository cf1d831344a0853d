// sort: a stable radix sort of lists of keys, 8 bits a pass, each key with its place in the unsorted list. No atomics:
// one work-item per chunk of a list counts in a column of its own.
//   keys [lists, n]   counts [lists, 256, chunks + 1]
//
//   count    column of a chunk: how many keys of each digit it has
//   scan     row of a digit: sums over the chunks before; the total stands behind the last
//   move     a chunk's keys, in order, to where their digit's keys from this chunk begin
#include "common.clh"
#ifndef CHUNK
#define CHUNK 512
#endif
#define DIGITS 256
#define DIGIT(key) (((key) >> shift) & (DIGITS - 1))

KERNEL void sort_count(IN int* restrict keys, GLOBAL int* restrict counts, int n, int shift, int chunks) {
  const int chunk = get_global_id(0), list = get_global_id(1);
  if (chunk >= chunks) return;
  GLOBAL int* column = counts + (size_t)list * DIGITS * (chunks + 1) + chunk;
  for (int d = 0; d < DIGITS; ++d) column[d * (chunks + 1)] = 0;
  for (int i = chunk * CHUNK; i < min((chunk + 1) * CHUNK, n); ++i)
    ++column[DIGIT(keys[(size_t)list * n + i]) * (chunks + 1)];
}

KERNEL void sort_scan(GLOBAL int* restrict counts, int chunks) {
  const int digit = get_global_id(0), list = get_global_id(1);
  GLOBAL int* row = counts + ((size_t)list * DIGITS + digit) * (chunks + 1);
  int sum = 0;
  for (int chunk = 0; chunk < chunks; ++chunk) {
    const int own = row[chunk];
    row[chunk] = sum;
    sum += own;
  }
  row[chunks] = sum;
}

// Without `places` the keys are in their first order.
KERNEL void sort_move(IN int* restrict keys, IN int* restrict places, GLOBAL int* restrict counts,
                      GLOBAL int* restrict sorted_keys, GLOBAL int* restrict sorted_places, int n, int shift,
                      int chunks) {
  const int chunk = get_global_id(0), list = get_global_id(1);
  if (chunk >= chunks) return;
  GLOBAL int* column = counts + (size_t)list * DIGITS * (chunks + 1) + chunk;
  int before = 0;  // keys of smaller digits
  for (int d = 0; d < DIGITS; ++d) {
    column[d * (chunks + 1)] += before;
    before += column[d * (chunks + 1) + chunks - chunk];
  }
  for (int i = chunk * CHUNK; i < min((chunk + 1) * CHUNK, n); ++i) {
    const size_t from = (size_t)list * n + i;
    const int key = keys[from];
    const size_t to = (size_t)list * n + column[DIGIT(key) * (chunks + 1)]++;
    sorted_keys[to] = key;
    sorted_places[to] = places ? places[from] : i;
  }
}
