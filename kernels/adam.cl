// adam: one step of Adam over a flat buffer of P parameters, in blocks of 64 that share a learning rate.
//
//   adam_find    bad [chunks]: the first element of each chunk of gradients that is no finite number, or -1
//   adam_prepare one work-item: judges the step (status) and computes the bias corrections
//   adam_update  one vector of VW elements per work-item; leaves everything alone once status is set
//
//   blocks   | 64 | 64 | 64 | ...     groups: u8 per block, 255 is frozen
//
// NaN and infinity are found by their exponent bits, which no floating-point option of the compiler can touch.
#include "common.clh"

#ifdef REAL_IS_DOUBLE
#define BITS(x) as_ulong(x)
#define EXPONENT 0x7ff0000000000000UL
#else
#define BITS(x) as_uint(x)
#define EXPONENT 0x7f800000U
#endif
#define NOT_FINITE(x) ((BITS(x) & EXPONENT) == EXPONENT)
#define BLOCK 64
#define FROZEN 255

KERNEL void adam_find(IN REAL* restrict gradients, IN uchar* restrict groups, GLOBAL int* restrict bad, int elements,
                      int chunk_elements) {
  const int chunk = get_global_id(0), first = chunk * chunk_elements;
  if (first >= elements) return;
  const int end = min(first + chunk_elements, elements);
  int found = -1;
  for (int block = first; block < end && found < 0; block += BLOCK) {
    if (groups[block / BLOCK] == FROZEN) continue;
    int any_bad = 0;
    for (int i = 0; i < BLOCK; ++i) any_bad |= NOT_FINITE(gradients[block + i]);
    for (int i = BLOCK - 1; any_bad && i >= 0; --i)
      if (NOT_FINITE(gradients[block + i])) found = block + i;
  }
  bad[chunk] = found;
}

// corrections: 1 / (1 - beta1^t), 1 / sqrt(1 - beta2^t)
KERNEL void adam_prepare(IN int* restrict bad, IN int* restrict step, IN REAL* restrict loss, IN int* restrict overflow,
                         GLOBAL int* restrict status, GLOBAL REAL* restrict corrections, int chunks, REAL log_beta1,
                         REAL log_beta2) {
  if (get_global_id(0) > 0) return;
  const REAL t = (REAL)step[0];
  corrections[0] = 1 / -expm1(t * log_beta1);
  corrections[1] = 1 / sqrt(-expm1(t * log_beta2));
  if (!status || status[0] != 0) return;
  int found = -1;
  for (int chunk = 0; chunk < chunks && found < 0; ++chunk) found = bad[chunk];
  const int what = overflow && overflow[0] != 0 ? 3 : found >= 0 ? 1 : loss && NOT_FINITE(loss[0]) ? 2 : 0;
  if (what == 0) return;
  status[0] = what;
  status[1] = step[0];
  status[2] = what == 1 ? found : -1;
}

KERNEL void adam_update(GLOBAL REAL* restrict parameters, IN REAL* restrict gradients, GLOBAL REAL* restrict first,
                        GLOBAL REAL* restrict second, IN uchar* restrict groups, IN REAL* restrict rates,
                        IN int* restrict status, IN REAL* restrict corrections, int elements, REAL beta1, REAL rest1,
                        REAL beta2, REAL rest2, REAL epsilon) {
  const int i = get_global_id(0) * VW;
  if (i >= elements || (status && status[0] != 0)) return;
  const int group = groups[i / BLOCK];
  if (group == FROZEN) return;
  const REALV g = VLOAD(0, gradients + i);
  const REALV m = beta1 * VLOAD(0, first + i) + rest1 * g;
  const REALV v = beta2 * VLOAD(0, second + i) + rest2 * g * g;
  const REALV change = rates[group] * corrections[0] * m / (sqrt(v) * corrections[1] + epsilon);
  VSTORE(m, 0, first + i);
  VSTORE(v, 0, second + i);
  VSTORE(VLOAD(0, parameters + i) - change, 0, parameters + i);
}
