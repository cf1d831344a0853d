// reduction: sums in a fixed order, so that the bits do not depend on the number of threads.
//   sum_rows_partial   x [rows, C] -> partial [chunks, C]; one work-item per chunk of rows and vector of channels
//   sum_flat_partial   x [n]       -> partial [chunks, 1]; one work-item per chunk of elements
//   reduce_partials    partial [chunks, n] -> y [n], chunk after chunk
#include "common.clh"

KERNEL void sum_rows_partial(IN REAL* restrict x, GLOBAL REAL* restrict partial, int capacity, int channels,
                             int chunk_rows, IN int* count) {
  const int chunk = get_global_id(0), c = get_global_id(1) * VW;
  const int first = chunk * chunk_rows, end = min(first + chunk_rows, live_rows(capacity, count));
  if (first >= capacity || c >= channels) return;
  if (c + VW <= channels) {
    REALV sum = (REALV)(0);
    for (int r = first; r < end; ++r) sum += VLOAD(0, x + (size_t)r * channels + c);
    VSTORE(sum, 0, partial + (size_t)chunk * channels + c);
  } else {
    for (int k = c; k < channels; ++k) {
      REAL sum = 0;
      for (int r = first; r < end; ++r) sum += x[(size_t)r * channels + k];
      partial[(size_t)chunk * channels + k] = sum;
    }
  }
}

KERNEL void sum_flat_partial(IN REAL* restrict x, GLOBAL REAL* restrict partial, int rows, int channels,
                             int chunk_elements, IN int* count) {
  const int chunk = get_global_id(0);
  const int first = chunk * chunk_elements, capacity = rows * channels;
  if (first >= capacity) return;
  const int end = min(first + chunk_elements, live_rows(rows, count) * channels);
  REAL lanes[VW];
  REALV sum = (REALV)(0);
  int i = first;
  for (; i + VW <= end; i += VW) sum += VLOAD(0, x + i);
  VSTORE(sum, 0, lanes);
  REAL total = 0;
  for (int lane = 0; lane < VW; ++lane) total += lanes[lane];
  for (; i < end; ++i) total += x[i];
  partial[chunk] = total;
}

KERNEL void reduce_partials(IN REAL* restrict partial, GLOBAL REAL* restrict y, int chunks, int n) {
  const int i = get_global_id(0) * VW;
  if (i + VW <= n) {
    REALV sum = (REALV)(0);
    for (int k = 0; k < chunks; ++k) sum += VLOAD(0, partial + (size_t)k * n + i);
    VSTORE(sum, 0, y + i);
  } else {
    for (int e = i; e < n; ++e) {
      REAL sum = 0;
      for (int k = 0; k < chunks; ++k) sum += partial[(size_t)k * n + e];
      y[e] = sum;
    }
  }
}

// One work-item per group and vector of channels.
KERNEL void sum_groups(IN REAL* restrict x, GLOBAL REAL* restrict y, int groups, int group_rows, int channels) {
  const int group = get_global_id(0), c = get_global_id(1) * VW;
  if (group >= groups || c >= channels) return;
  IN REAL* from = x + (size_t)group * group_rows * channels;
  if (c + VW <= channels) {
    REALV sum = (REALV)(0);
    for (int r = 0; r < group_rows; ++r) sum += VLOAD(0, from + (size_t)r * channels + c);
    VSTORE(sum, 0, y + (size_t)group * channels + c);
  } else {
    for (int k = c; k < channels; ++k) {
      REAL sum = 0;
      for (int r = 0; r < group_rows; ++r) sum += from[(size_t)r * channels + k];
      y[(size_t)group * channels + k] = sum;
    }
  }
}

KERNEL void repeat_rows(IN REAL* restrict x, GLOBAL REAL* restrict y, int rows, int times, int channels) {
  const int r = get_global_id(0);
  if (r >= rows * times) return;
  for (int c = 0; c < channels; ++c) y[(size_t)r * channels + c] = x[(size_t)(r / times) * channels + c];
}

KERNEL void sum_channels(IN REAL* restrict x, GLOBAL REAL* restrict y, int rows, int channels, IN int* count) {
  const int r = get_global_id(0);
  if (r >= live_rows(rows, count)) return;
  REAL sum = 0;
  for (int c = 0; c < channels; ++c) sum += x[(size_t)r * channels + c];
  y[r] = sum;
}

KERNEL void broadcast_row(IN REAL* restrict row, GLOBAL REAL* restrict y, int rows, int channels, IN int* count) {
  const int r = get_global_id(0);
  if (r >= live_rows(rows, count)) return;
  for (int c = 0; c < channels; ++c) y[(size_t)r * channels + c] = row[c];
}

KERNEL void broadcast_channels(IN REAL* restrict x, GLOBAL REAL* restrict y, int rows, int channels, IN int* count) {
  const int r = get_global_id(0);
  if (r >= live_rows(rows, count)) return;
  const REAL value = x[r];
  for (int c = 0; c < channels; ++c) y[(size_t)r * channels + c] = value;
}
