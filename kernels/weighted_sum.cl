// weighted_sum: out [R,C] = the sum over a ray's samples of weight [R,S] times feature.
//   Row k of feature belongs to sample SAMPLE(k) of the R * S: k itself, or ids[k], which ascend.
//
//   ids      0  1 | 5  7 | 9          samples of ray r: [r S, r S + S)
//   feature  ====================     rows of ray r: found by bisection
#include "lanes.clh"
#ifndef HAS_IDS
#define HAS_IDS 0
#endif
#if HAS_IDS
#define SAMPLE(k) ids[k]
#else
#define SAMPLE(k) (k)
#endif

// Rows are asked for this many numbers ahead: in fp32 a page of 4 KiB, at which the processor itself stops looking
// ahead.
#define AHEAD 1024
#if GPU_FORM
#define ASK_FOR(p)
#else
#define ASK_FOR(p) __builtin_prefetch(p)
#endif

// The first of `rows` rows whose sample is at least `sample`.
inline int first_row(IN int* ids, int rows, int sample) {
#if HAS_IDS
  int low = 0, high = rows;
  while (low < high) {
    const int middle = (low + high) / 2;
    if (ids[middle] < sample)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
#else
  return sample;
#endif
}

KERNEL void weighted_sum(IN REAL* restrict weight, IN REAL* restrict feature, IN int* restrict ids,
                         GLOBAL REAL* restrict out, int rays, int samples, int capacity, IN int* count) {
  const int first_vector = get_global_id(0) * VECTORS_PER_ITEM, ray = get_global_id(1);
  if (ray >= rays || first_vector >= VECTORS) return;
  const int rows = live_rows(capacity, count);
  const int end = first_row(ids, rows, (ray + 1) * samples);
  LANE sum[VECTORS_PER_ITEM];
  UNROLL for (int v = 0; v < VECTORS_PER_ITEM; ++v) sum[v] = (LANE)(0);
  for (int k = first_row(ids, rows, ray * samples); k < end; ++k) {
    const REAL w = weight[SAMPLE(k)];
    if (w == 0) continue;
    IN REAL* row = feature + (size_t)k * CHANNELS + first_vector * LANES;
    UNROLL for (int v = 0; v < VECTORS_PER_ITEM; ++v) {
      ASK_FOR(row + AHEAD + v * LANES);
      sum[v] += w * LOAD(row + v * LANES);
    }
  }
  GLOBAL REAL* target = out + (size_t)ray * CHANNELS + first_vector * LANES;
  UNROLL for (int v = 0; v < VECTORS_PER_ITEM; ++v) STORE(sum[v], target + v * LANES);
}

// grad_weight [R,S] of the samples that have a row: <grad_out, feature>.
KERNEL void weighted_sum_weight_gradient(IN REAL* restrict feature, IN int* restrict ids, IN REAL* restrict grad_out,
                                         GLOBAL REAL* restrict grad_weight, int samples, int capacity, int block,
                                         IN int* count) {
  const int first = get_global_id(0) * block, end = min(first + block, live_rows(capacity, count));
  for (int k = first; k < end; ++k) {
    IN REAL* row = feature + (size_t)k * CHANNELS;
    IN REAL* grad = grad_out + (size_t)(SAMPLE(k) / samples) * CHANNELS;
    LANE dot = (LANE)(0);
    for (int v = 0; v < VECTORS; ++v) ASK_FOR(row + AHEAD + v * LANES);
    for (int v = 0; v < VECTORS; ++v) dot += LOAD(row + v * LANES) * LOAD(grad + v * LANES);
    grad_weight[SAMPLE(k)] = sum_lanes(dot);
  }
}

// grad_feature: weight * grad_out. PAST_CACHES: it is so large that lines would only be read to be replaced; the end
// of the kernel orders these stores.
#ifndef PAST_CACHES
#define PAST_CACHES 0
#endif
#if PAST_CACHES && defined(__has_builtin)
#if __has_builtin(__builtin_nontemporal_store)
#define STORE_GRADIENT(value, p) __builtin_nontemporal_store(value, (GLOBAL LANE*)(p))
#endif
#endif
#ifndef STORE_GRADIENT
#define STORE_GRADIENT STORE
#endif

KERNEL void weighted_sum_feature_gradient(IN REAL* restrict weight, IN int* restrict ids, IN REAL* restrict grad_out,
                                          GLOBAL REAL* restrict grad_feature, int samples, int capacity, int block,
                                          IN int* count) {
  const int first_vector = get_global_id(0) * VECTORS_PER_ITEM, first = get_global_id(1) * block;
  const int end = min(first + block, live_rows(capacity, count));
  if (first_vector >= VECTORS) return;
  for (int k = first; k < end; ++k) {
    IN REAL* grad = grad_out + (size_t)(SAMPLE(k) / samples) * CHANNELS;
    const REAL w = weight[SAMPLE(k)];
    UNROLL for (int v = first_vector; v < first_vector + VECTORS_PER_ITEM; ++v)
      STORE_GRADIENT(w * LOAD(grad + v * LANES), grad_feature + (size_t)k * CHANNELS + v * LANES);
  }
}
