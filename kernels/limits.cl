// limits: what the device can do at most, for `vivant bench`.
//   fma_chains  y [items][VW]: CHAINS independent chains x = x * m + a of STEPS steps; starts at 1 / (chain + 1)
//   triad       y [n] = a [n] + s * b [n]
//   read_sum    partial [items][VW]: sums of x [n], every element read once
//   touch       one store: the cost of a launch
//   matrix_products  y [items]: STEPS times a . w [32, 128] . [128, 64] of ones on matrix units, summed: 128 STEPS
// A work-item of triad and read_sum takes BLOCK vectors: one run of memory on CPUs, with a stride of all work-items
// on GPUs, where neighbours read side by side.
#include "common.clh"
#include "matrix_units.clh"

#ifndef CHAINS
#define CHAINS 16
#endif
#ifndef BLOCK
#define BLOCK 8
#endif

#if GPU_FORM
#define VECTOR(v) ((v) * get_global_size(0) + get_global_id(0))
#else
#define VECTOR(v) (get_global_id(0) * BLOCK + (v))
#endif

KERNEL void fma_chains(GLOBAL REAL* restrict y, REAL multiplier, REAL addend, int steps) {
  const REALV m = (REALV)(multiplier), a = (REALV)(addend);
  REALV x[CHAINS];
  UNROLL for (int c = 0; c < CHAINS; ++c) x[c] = (REALV)((REAL)1 / (c + 1));
  for (int step = 0; step < steps; ++step) {
    UNROLL for (int c = 0; c < CHAINS; ++c) x[c] = x[c] * m + a;
  }
  REALV sum = x[0];
  UNROLL for (int c = 1; c < CHAINS; ++c) sum += x[c];
  VSTORE(sum, get_global_id(0), y);
}

KERNEL void triad(IN REAL* restrict a, IN REAL* restrict b, GLOBAL REAL* restrict y, REAL s) {
  for (int v = 0; v < BLOCK; ++v) VSTORE(VLOAD(VECTOR(v), a) + s * VLOAD(VECTOR(v), b), VECTOR(v), y);
}

KERNEL void read_sum(IN REAL* restrict x, GLOBAL REAL* restrict partial) {
  REALV sums[4];
  UNROLL for (int k = 0; k < 4; ++k) sums[k] = (REALV)(0);
  for (int v = 0; v < BLOCK; v += 4) {
    UNROLL for (int k = 0; k < 4; ++k) sums[k] += VLOAD(VECTOR(v + k), x);
  }
  VSTORE((sums[0] + sums[1]) + (sums[2] + sums[3]), get_global_id(0), partial);
}

KERNEL void touch(GLOBAL REAL* y) { y[get_global_id(0)] = get_global_id(0) + 1; }

#if MATRIX_UNITS
KERNEL void matrix_products(GLOBAL float* restrict y, int steps) {
  uint a[2 * 32 * 64] ALIGNED, w[2 * 64 * 64] ALIGNED;
  float c[32 * 64] ALIGNED;
  for (int i = 0; i < 2 * 32 * 64; ++i) a[i] = i < 32 * 64 ? 0x3f803f80 : 0;  // 1 and 1, lo parts 0
  for (int i = 0; i < 2 * 64 * 64; ++i) w[i] = i < 64 * 64 ? 0x3f803f80 : 0;
  BEGIN_UNITS
  for (int step = 0; step < steps; ++step)
    product(PASS_REGISTERS OPERAND(a, 256, 4 * 32 * 64, 0, 0), 16 * 256, OPERAND(w, 256, 4 * 64 * 64, 0, 0), 64, 64, 1, 1,
            PRODUCTS, c, 64, step > 0);
  END_UNITS
  y[get_global_id(0)] = c[get_global_id(0) % (32 * 64)];
}
#endif
