// mean_variance_norm: statistics of every channel over n live rows, y = (x - mean) / deviation, and the gradients.
//
//            channels ->
//   rows  | chunk 0 | : one work-item per chunk of rows and vector of channels writes two partial sums, [chunks, 2, C];
//         | chunk 1 |   they are added in the order of the chunks
//
//   statistics           deviation^2 = sum (x - mean)^2 / (n - 1) + epsilon; a chunk sums about its own mean m_k,
//                        corrected by what that pass leaves over; M2 = sum_k [M2_k + n_k (m_k - mean)^2]
//   statistics_gradient  grad_x = grad_mean / n + grad_deviation (x - mean) / ((n - 1) deviation)
//   update_running       running += momentum (batch - running), unless *stop
//   standardise_gradient grad_x = (g - sum g / n - y sum(g y) / (n - 1)) / deviation, y = (x - mean) / deviation, or
//                        g / deviation when the statistics are not those of x
//
// The element-wise kernels run over (vectors of channels, rows).
#include "channels.clh"

KERNEL void statistics_partial(IN REAL* restrict x, GLOBAL REAL* restrict partial, int capacity, int channels,
                               int chunk_rows, IN int* count) {
  const int chunk = get_global_id(0), c = get_global_id(1) * VW;
  const int first = chunk * chunk_rows, end = min(first + chunk_rows, live_rows(capacity, count));
  if (first >= capacity || c >= channels) return;
  GLOBAL REAL* out = partial + (size_t)chunk * 2 * channels;
#define BODY(T, LOAD, STORE, i)                                                                                       \
  T sum = (T)(0), squares = (T)(0), rest = (T)(0);                                                                    \
  for (int r = first; r < end; ++r) sum += LOAD(x + (size_t)r * channels + i);                                        \
  const REAL by_rows = (REAL)1 / max(1, end - first);                                                                 \
  const T mean = by_rows * sum;                                                                                       \
  for (int r = first; r < end; ++r) {                                                                                 \
    const T d = LOAD(x + (size_t)r * channels + i) - mean;                                                            \
    rest += d;                                                                                                        \
    squares += d * d;                                                                                                 \
  }                                                                                                                   \
  STORE(mean + by_rows * rest, out + i);                                                                              \
  STORE(squares - by_rows * rest * rest, out + channels + i);
  FOR_CHANNELS(c, channels, BODY)
#undef BODY
}

KERNEL void statistics_combine(IN REAL* restrict partial, GLOBAL REAL* restrict mean, GLOBAL REAL* restrict deviation,
                               int chunks, int capacity, int channels, int chunk_rows, REAL epsilon, IN int* count) {
  const int c = get_global_id(0) * VW, rows = live_rows(capacity, count);
  if (c >= channels) return;
#define BODY(T, LOAD, STORE, i)                                                                                       \
  const T start = LOAD(partial + i);                                                                                  \
  T offset = (T)(0), squares = (T)(0);                                                                                \
  for (int k = 0; k < chunks; ++k)                                                                                    \
    offset += (REAL)clamp(rows - k * chunk_rows, 0, chunk_rows) * (LOAD(partial + (size_t)2 * k * channels + i) - start);\
  const T center = start + offset / (REAL)max(1, rows);                                                               \
  for (int k = 0; k < chunks; ++k) {                                                                                  \
    const T d = LOAD(partial + (size_t)2 * k * channels + i) - center;                                                \
    squares += LOAD(partial + (size_t)(2 * k + 1) * channels + i) +                                                   \
               (REAL)clamp(rows - k * chunk_rows, 0, chunk_rows) * d * d;                                             \
  }                                                                                                                   \
  STORE(center, mean + i);                                                                                            \
  STORE(sqrt(squares / (REAL)max(1, rows - 1) + epsilon), deviation + i);
  FOR_CHANNELS(c, channels, BODY)
#undef BODY
}

KERNEL void statistics_gradient(IN REAL* restrict x, IN REAL* restrict mean, IN REAL* restrict deviation,
                                IN REAL* restrict grad_mean, IN REAL* restrict grad_deviation,
                                GLOBAL REAL* restrict grad_x, int capacity, int channels, IN int* count) {
  const int row = get_global_id(1), rows = live_rows(capacity, count);
  if (row >= rows) return;
  const REAL by_mean = (REAL)1 / rows, by_deviation = (REAL)1 / max(1, rows - 1);
  const size_t at = (size_t)row * channels;
#define BODY(T, LOAD, STORE, i)                                                                                       \
  STORE(by_mean * LOAD(grad_mean + i) + by_deviation * LOAD(grad_deviation + i) *                                     \
                                            (LOAD(x + at + i) - LOAD(mean + i)) / LOAD(deviation + i),                \
        grad_x + at + i);
  FOR_ROW(channels, BODY)
#undef BODY
}

KERNEL void update_running(GLOBAL REAL* restrict running, IN REAL* restrict batch, IN int* restrict stop, int channels,
                           REAL momentum) {
  const int c = get_global_id(0);
  if (c >= channels || (stop && stop[0] != 0)) return;
  running[c] += momentum * (batch[c] - running[c]);
}

KERNEL void standardise(IN REAL* restrict x, IN REAL* restrict mean, IN REAL* restrict deviation,
                        GLOBAL REAL* restrict y, int capacity, int channels, IN int* count) {
  const int row = get_global_id(1);
  if (row >= live_rows(capacity, count)) return;
  const size_t at = (size_t)row * channels;
#define BODY(T, LOAD, STORE, i) STORE((LOAD(x + at + i) - LOAD(mean + i)) / LOAD(deviation + i), y + at + i);
  FOR_ROW(channels, BODY)
#undef BODY
}

// partial: sum g, sum g y
KERNEL void standardise_partial(IN REAL* restrict y, IN REAL* restrict grad_y, GLOBAL REAL* restrict partial,
                                int capacity, int channels, int chunk_rows, IN int* count) {
  const int chunk = get_global_id(0), c = get_global_id(1) * VW;
  const int first = chunk * chunk_rows, end = min(first + chunk_rows, live_rows(capacity, count));
  if (first >= capacity || c >= channels) return;
  GLOBAL REAL* out = partial + (size_t)chunk * 2 * channels;
#define BODY(T, LOAD, STORE, i)                                                                                       \
  T sum = (T)(0), product = (T)(0);                                                                                   \
  for (int r = first; r < end; ++r) {                                                                                 \
    const T g = LOAD(grad_y + (size_t)r * channels + i);                                                              \
    sum += g;                                                                                                         \
    product += g * LOAD(y + (size_t)r * channels + i);                                                                \
  }                                                                                                                   \
  STORE(sum, out + i);                                                                                                \
  STORE(product, out + channels + i);
  FOR_CHANNELS(c, channels, BODY)
#undef BODY
}

// sums: [2, C], or null for given statistics
KERNEL void standardise_gradient(IN REAL* restrict y, IN REAL* restrict deviation, IN REAL* restrict grad_y,
                                 IN REAL* restrict sums, GLOBAL REAL* restrict grad_x, int capacity, int channels,
                                 IN int* count) {
  const int row = get_global_id(1), rows = live_rows(capacity, count);
  if (row >= rows) return;
  const REAL by_mean = (REAL)1 / rows, by_deviation = (REAL)1 / max(1, rows - 1);
  const size_t at = (size_t)row * channels;
#define BODY(T, LOAD, STORE, i)                                                                                       \
  T g = LOAD(grad_y + at + i);                                                                                        \
  if (sums) g -= by_mean * LOAD(sums + i) + by_deviation * LOAD(y + at + i) * LOAD(sums + channels + i);              \
  STORE(g / LOAD(deviation + i), grad_x + at + i);
  FOR_ROW(channels, BODY)
#undef BODY
}
