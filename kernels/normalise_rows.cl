// normalise_rows: y = x / length, length = sqrt(x . x + epsilon), row by row; one work-item per row.
//   gradient: grad_x = (g - y (y . g)) / length
#include "channels.clh"

inline REAL row_product(IN REAL* a, IN REAL* b, int channels) {
  REAL lanes[VW], sum = 0;
  REALV vector = (REALV)(0);
  int c = 0;
  for (; c + VW <= channels; c += VW) vector += VLOAD(0, a + c) * VLOAD(0, b + c);
  VSTORE(vector, 0, lanes);
  for (int i = 0; i < VW; ++i) sum += lanes[i];
  for (; c < channels; ++c) sum += a[c] * b[c];
  return sum;
}

KERNEL void normalise_rows(IN REAL* restrict x, GLOBAL REAL* restrict y, int capacity, int channels, REAL epsilon,
                           IN int* count) {
  const int row = get_global_id(0);
  if (row >= live_rows(capacity, count)) return;
  const size_t at = (size_t)row * channels;
  const REAL scale = 1 / sqrt(row_product(x + at, x + at, channels) + epsilon);
#define BODY(T, LOAD, STORE, i) STORE(scale * LOAD(x + at + i), y + at + i);
  for (int c = 0; c < channels; c += VW) FOR_CHANNELS(c, channels, BODY)
#undef BODY
}

KERNEL void normalise_rows_gradient(IN REAL* restrict x, IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x,
                                    int capacity, int channels, REAL epsilon, IN int* count) {
  const int row = get_global_id(0);
  if (row >= live_rows(capacity, count)) return;
  const size_t at = (size_t)row * channels;
  const REAL scale = 1 / sqrt(row_product(x + at, x + at, channels) + epsilon);
  const REAL along = scale * scale * row_product(x + at, grad_y + at, channels);
#define BODY(T, LOAD, STORE, i) STORE(scale * (LOAD(grad_y + at + i) - along * LOAD(x + at + i)), grad_x + at + i);
  for (int c = 0; c < channels; c += VW) FOR_CHANNELS(c, channels, BODY)
#undef BODY
}
