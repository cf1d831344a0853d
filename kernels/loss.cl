// loss: mean over n = live rows * channels elements of weight[row] * f(x, target), and its gradient.
//
//   loss_partial   partial [chunks]: one work-item per chunk of elements
//   loss_mean      y [1] = sum of partial / n
//   loss_gradient  grad_x = grad_y / n * weight[row] * f'(x, target); one vector of VW elements per work-item
//
// LOSS names f: L1 |x - t|, L2 (x - t)^2, HARD log(1 + 1/e) - log(e^-|x| + e^-|1 - x|), without a target.
#include "common.clh"
#define L1 0
#define L2 1
#define HARD 2
#ifndef LOSS
#define LOSS L1
#endif
#ifndef WEIGHTED
#define WEIGHTED 0
#endif

#if LOSS == L1
#define TERM(T, x, t) fabs((x) - (t))
#define SLOPE(T, x, t) sign((x) - (t))
#elif LOSS == L2
#define TERM(T, x, t) (((x) - (t)) * ((x) - (t)))
#define SLOPE(T, x, t) (2 * ((x) - (t)))
#else
#define NEAR_0(x) exp(-fabs(x))
#define NEAR_1(x) exp(-fabs(1 - (x)))
#define TERM(T, x, t) ((REAL)0.31326168751822286 - log(NEAR_0(x) + NEAR_1(x)))
// sign(x (1 - x)) is 0 at the two minima, which are kinks.
#define SLOPE(T, x, t) \
  (fabs(sign((x) * (1 - (x)))) * (sign(x) * NEAR_0(x) - sign(1 - (x)) * NEAR_1(x)) / (NEAR_0(x) + NEAR_1(x)))
#endif
#if LOSS == HARD
#define TARGET(load) 0
#else
#define TARGET(load) load
#endif
#if WEIGHTED
#define WEIGHT(e) weights[(e) / channels]
#else
#define WEIGHT(e) 1
#endif

KERNEL void loss_partial(IN REAL* restrict x, IN REAL* restrict target, IN REAL* restrict weights,
                         GLOBAL REAL* restrict partial, int rows, int channels, int chunk_elements, IN int* count) {
  const int chunk = get_global_id(0), first = chunk * chunk_elements;
  if (first >= rows * channels) return;
  const int end = min(first + chunk_elements, live_rows(rows, count) * channels);
  REAL total = 0;
  int i = first;
#if !WEIGHTED
  REAL lanes[VW];
  REALV sum = (REALV)(0);
  for (; i + VW <= end; i += VW) sum += TERM(REALV, VLOAD(0, x + i), TARGET(VLOAD(0, target + i)));
  VSTORE(sum, 0, lanes);
  for (int lane = 0; lane < VW; ++lane) total += lanes[lane];
#endif
  for (; i < end; ++i) total += WEIGHT(i) * TERM(REAL, x[i], TARGET(target[i]));
  partial[chunk] = total;
}

KERNEL void loss_mean(IN REAL* restrict partial, GLOBAL REAL* restrict y, int chunks, int rows, int channels,
                      IN int* count) {
  if (get_global_id(0) > 0) return;
  REAL total = 0;
  for (int chunk = 0; chunk < chunks; ++chunk) total += partial[chunk];
  y[0] = total / max(1, live_rows(rows, count) * channels);
}

KERNEL void loss_gradient(IN REAL* restrict x, IN REAL* restrict target, IN REAL* restrict weights,
                          IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x, int rows, int channels,
                          IN int* count) {
  const int i = get_global_id(0) * VW, n = live_rows(rows, count) * channels;
  const REAL scale = grad_y[0] / max(1, n);
#if !WEIGHTED
  if (i + VW <= n) {
    VSTORE(scale * SLOPE(REALV, VLOAD(0, x + i), TARGET(VLOAD(0, target + i))), 0, grad_x + i);
    return;
  }
#endif
  for (int e = i; e < min(i + VW, n); ++e) grad_x[e] = scale * WEIGHT(e) * SLOPE(REAL, x[e], TARGET(target[e]));
}
