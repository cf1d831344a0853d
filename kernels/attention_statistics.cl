// attention_statistics: o [N, 2 C] holds A u and A u^2 of values u relative to `center` [C]:
//   mean = A u + center,  deviation = sqrt(max(0, A u^2 - (A u)^2))
// The gradient of the deviation is 0 where the deviation is 0. Kernels run over (vectors of channels, rows).
//
// A query that attends to a single key has A u^2 = u u exactly as rounded: the square below must be rounded in the same
// way, and not be fused with the difference, for its deviation to be 0.
// SPLIT_PRODUCTS: A u and A u^2 are sums of products of three (matrix_units.clh), equal to 2^-17: what is left of a
// variance that small is rounding.
#include "channels.clh"
#ifndef SPLIT_PRODUCTS
#define SPLIT_PRODUCTS 0
#endif
#define LEAST_VARIANCE(T, second) (SPLIT_PRODUCTS ? (T)(3.0517578125e-5f) * (second) : (T)(0))
#pragma OPENCL FP_CONTRACT OFF

KERNEL void attention_statistics(IN REAL* restrict o, IN REAL* restrict center, GLOBAL REAL* restrict mean,
                                 GLOBAL REAL* restrict deviation, int rows, int channels) {
  const int row = get_global_id(1);
  if (row >= rows) return;
  const size_t at = (size_t)row * channels;
#define BODY(T, LOAD, STORE, i)                                                      \
  const T first = LOAD(o + 2 * at + i), second = LOAD(o + 2 * at + channels + i);    \
  STORE(first + LOAD(center + i), mean + at + i);                                    \
  const T variance = fmax(second - first * first, (T)(0));                           \
  STORE(sqrt(variance * step(LEAST_VARIANCE(T, second), variance)), deviation + at + i);
  FOR_ROW(channels, BODY)
#undef BODY
}

KERNEL void attention_statistics_gradient(IN REAL* restrict o, IN REAL* restrict deviation, IN REAL* restrict grad_mean,
                                          IN REAL* restrict grad_deviation, GLOBAL REAL* restrict grad_o, int rows,
                                          int channels) {
  const int row = get_global_id(1);
  if (row >= rows) return;
  const size_t at = (size_t)row * channels;
#define BODY(T, LOAD, STORE, i)                                                                             \
  const T d = LOAD(deviation + at + i), alive = step((T)(1e-30f), d);                                       \
  const T second = alive * LOAD(grad_deviation + at + i) / (2 * d + (1 - alive));                           \
  STORE(LOAD(grad_mean + at + i) - 2 * LOAD(o + 2 * at + i) * second, grad_o + 2 * at + i);                 \
  STORE(second, grad_o + 2 * at + channels + i);
  FOR_ROW(channels, BODY)
#undef BODY
}
