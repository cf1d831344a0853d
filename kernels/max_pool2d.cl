// max_pool2d: y [out_height, out_width, C] = the largest value of each 2x2 window of x [height, width, C]:
//
//     a b | c d        max(a, b, e, f)  max(c, d, g, h)
//     e f | g h
//
// Windows at the lower and right edge may have one row or column. The gradient finds the maximum again instead of
// keeping its index; one work-item owns a window of x, also where x has a last row that no output sees.
// Work-items: (vectors of channels, window x, window y); a work-item takes every n-th vector, n the range of axis 0.
// LANES is 1 for channel counts that are not whole vectors.
#include "lanes.clh"

#define FOR_WINDOW(row, column)                                   \
  for (int i = 2 * row; i < min(2 * row + 2, height); ++i)        \
    for (int j = 2 * column; j < min(2 * column + 2, width); ++j)

inline LANE window_maximum(IN REAL* x, int row, int column, int height, int width, int channels) {
  LANE largest = LOAD(x + (size_t)(2 * row * width + 2 * column) * channels);
  FOR_WINDOW(row, column) largest = fmax(largest, LOAD(x + (size_t)(i * width + j) * channels));
  return largest;
}

KERNEL void max_pool2d(IN REAL* restrict x, GLOBAL REAL* restrict y, int height, int width, int out_height,
                       int out_width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= out_width || row >= out_height) return;
  GLOBAL REAL* out = y + (size_t)(row * out_width + column) * channels;
  for (int e = get_global_id(0) * LANES; e < channels; e += get_global_size(0) * LANES)
    STORE(window_maximum(x + e, row, column, height, width, channels), out + e);
}

KERNEL void max_pool2d_gradient(IN REAL* restrict x, IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x, int height,
                                int width, int out_height, int out_width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (2 * column >= width || 2 * row >= height) return;
  const bool pooled = column < out_width && row < out_height;
  IN REAL* g = grad_y + (size_t)(row * out_width + column) * channels;
  for (int e = get_global_id(0) * LANES; e < channels; e += get_global_size(0) * LANES) {
    const LANE largest = window_maximum(x + e, row, column, height, width, channels);
    LANE left = (LANE)(0);  // what the first maximum takes
    if (pooled) left = LOAD(g + e);
    FOR_WINDOW(row, column) {
      const size_t at = (size_t)(i * width + j) * channels + e;
      const LANE value = LOAD(x + at);
      STORE(value == largest ? left : (LANE)(0), grad_x + at);
      left = value == largest ? (LANE)(0) : left;
    }
  }
}
