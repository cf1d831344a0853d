// resize: bilinear, x [H, W, C] <-> y [H2, W2, C], pixel centres at +0.5.
//
//   Output o of an axis samples x at s(o) = (o + 0.5) in / out - 0.5, clamped to [0, in - 1]; input i has the weight
//
//        hat(o, i) = max(0, 1 - |s(o) - i|)            i-1   i   i+1
//                                                        \  /\  /
//   resize           y[o]      = sum_i hat(o, i) x[i]     \/  \/
//   resize_gradient  grad_x[i] = sum_o hat(o, i) grad_y[o]; one work-item owns a pixel of x, so no sum races
//
// s is kept as an integer numerator over 2 out. Work-items: (vectors of channels, x, y); a work-item takes every n-th
// vector, n being the range of axis 0.
#include "common.clh"

inline int numerator(int o, int in, int out) { return clamp((2 * o + 1) * in - out, 0, 2 * out * (in - 1)); }

inline REAL hat(int o, int i, int in, int out) {
  return fmax((REAL)0, 1 - (REAL)abs(numerator(o, in, out) - 2 * out * i) / (REAL)(2 * out));
}

// The outputs [x, y] that input i can reach; a few at the ends have weight 0.
inline int2 reach(int i, int in, int out) {
  const int first = i == 0 ? 0 : ((2 * i - 1) * out - in) / (2 * in);
  const int last = i == in - 1 ? out - 1 : ((2 * i + 3) * out - in) / (2 * in) + 1;
  return (int2)(max(first, 0), min(last, out - 1));
}

KERNEL void resize(IN REAL* restrict x, GLOBAL REAL* restrict y, int height, int width, int out_height, int out_width,
                   int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= out_width || row >= out_height) return;
  const int top = numerator(row, height, out_height) / (2 * out_height), bottom = min(top + 1, height - 1);
  const int left = numerator(column, width, out_width) / (2 * out_width), right = min(left + 1, width - 1);
  const REAL wy = hat(row, top, height, out_height), wx = hat(column, left, width, out_width);
  IN REAL* a = x + ((size_t)top * width + left) * channels;
  IN REAL* b = x + ((size_t)top * width + right) * channels;
  IN REAL* c = x + ((size_t)bottom * width + left) * channels;
  IN REAL* d = x + ((size_t)bottom * width + right) * channels;
  GLOBAL REAL* out = y + ((size_t)row * out_width + column) * channels;
  const REAL wa = wy * wx, wb = wy * (1 - wx), wc = (1 - wy) * wx, wd = (1 - wy) * (1 - wx);
  for (int e = get_global_id(0) * VW; e < channels; e += get_global_size(0) * VW) {
    if (e + VW <= channels) {
      VSTORE(wa * VLOAD(0, a + e) + wb * VLOAD(0, b + e) + wc * VLOAD(0, c + e) + wd * VLOAD(0, d + e), 0, out + e);
    } else {
      for (int k = e; k < channels; ++k) out[k] = wa * a[k] + wb * b[k] + wc * c[k] + wd * d[k];
    }
  }
}

KERNEL void resize_gradient(IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x, int height, int width,
                            int out_height, int out_width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= width || row >= height) return;
  const int2 rows = reach(row, height, out_height), columns = reach(column, width, out_width);
  GLOBAL REAL* target = grad_x + ((size_t)row * width + column) * channels;
  for (int e = get_global_id(0) * VW; e < channels; e += get_global_size(0) * VW) {
    const int left = channels - e;
    REALV sum = (REALV)(0);
    REAL tail[VW];
    for (int k = 0; k < VW; ++k) tail[k] = 0;
    for (int i = rows.x; i <= rows.y; ++i) {
      const REAL wy = hat(i, row, height, out_height);
      for (int j = columns.x; j <= columns.y; ++j) {
        const REAL weight = wy * hat(j, column, width, out_width);
        IN REAL* g = grad_y + ((size_t)i * out_width + j) * channels + e;
        if (left >= VW) {
          sum += weight * VLOAD(0, g);
        } else {
          for (int k = 0; k < left; ++k) tail[k] += weight * g[k];
        }
      }
    }
    if (left >= VW) {
      VSTORE(sum, 0, target + e);
    } else {
      for (int k = 0; k < left; ++k) target[e + k] = tail[k];
    }
  }
}
