// sort: a stable radix sort of lists of keys, DIGITS values a pass, each key with its place in the unsorted list. No
// atomics: one work-item per chunk of a list counts for itself.
//   keys [lists, n]   counts [lists, DIGITS, chunks + 1], on CPUs [lists, chunks + 1, DIGITS]
//
//   count    of a chunk: how many keys of each digit it has
//   scan     of a digit: sums over the chunks before; the total stands behind the last
//   move     a chunk's keys, in order, to where their digit's keys from this chunk begin
#include "common.clh"
#ifndef CHUNK
#define CHUNK 512
#endif
#ifndef DIGITS
#define DIGITS 256
#endif
#if GPU_FORM
#define COUNT(digit, chunk) ((size_t)(digit) * (chunks + 1) + (chunk))
#else
#define COUNT(digit, chunk) ((size_t)(chunk) * DIGITS + (digit))
#endif
#define DIGIT(key) (((key) >> shift) & (DIGITS - 1))

KERNEL void sort_count(IN int* restrict keys, GLOBAL int* restrict counts, int n, int shift, int chunks) {
  const int chunk = get_global_id(0), list = get_global_id(1);
  if (chunk >= chunks) return;
  counts += (size_t)list * DIGITS * (chunks + 1);
  for (int d = 0; d < DIGITS; ++d) counts[COUNT(d, chunk)] = 0;
  for (int i = chunk * CHUNK; i < min((chunk + 1) * CHUNK, n); ++i)
    ++counts[COUNT(DIGIT(keys[(size_t)list * n + i]), chunk)];
}

KERNEL void sort_scan(GLOBAL int* restrict counts, int chunks) {
  const int digit = get_global_id(0), list = get_global_id(1);
  counts += (size_t)list * DIGITS * (chunks + 1);
  int sum = 0;
  for (int chunk = 0; chunk < chunks; ++chunk) {
    const int own = counts[COUNT(digit, chunk)];
    counts[COUNT(digit, chunk)] = sum;
    sum += own;
  }
  counts[COUNT(digit, chunks)] = sum;
}

// Without `places` the keys are in their first order.
KERNEL void sort_move(IN int* restrict keys, IN int* restrict places, GLOBAL int* restrict counts,
                      GLOBAL int* restrict sorted_keys, GLOBAL int* restrict sorted_places, int n, int shift,
                      int chunks) {
  const int chunk = get_global_id(0), list = get_global_id(1);
  if (chunk >= chunks) return;
  counts += (size_t)list * DIGITS * (chunks + 1);
  int before = 0;  // keys of smaller digits
  for (int d = 0; d < DIGITS; ++d) {
    counts[COUNT(d, chunk)] += before;
    before += counts[COUNT(d, chunks)];
  }
  for (int i = chunk * CHUNK; i < min((chunk + 1) * CHUNK, n); ++i) {
    const size_t from = (size_t)list * n + i;
    const int key = keys[from];
    const size_t to = (size_t)list * n + counts[COUNT(DIGIT(key), chunk)]++;
    sorted_keys[to] = key;
    sorted_places[to] = places ? places[from] : i;
  }
}
