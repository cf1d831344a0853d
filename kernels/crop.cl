// crop: y [h, w, C] = the window of x [H, W, C] at (top, left); beyond the border the edge pixels repeat.
//
//   crop           y[i][j] = x[clamp(top + i)][clamp(left + j)]
//   crop_gradient  grad_x[r][c] = the sum of grad_y over all (i, j) that read (r, c): a block of several pixels at the
//                  edges, at most one inside; one work-item owns a pixel of x
//
// Work-items: (vectors of channels, x, y); a work-item takes every n-th vector, n being the range of axis 0.
#include "common.clh"

KERNEL void crop(IN REAL* restrict x, GLOBAL REAL* restrict y, int height, int width, int top, int left,
                 int out_height, int out_width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= out_width || row >= out_height) return;
  const size_t pixel = (size_t)clamp(top + row, 0, height - 1) * width + clamp(left + column, 0, width - 1);
  IN REAL* source = x + pixel * channels;
  GLOBAL REAL* target = y + ((size_t)row * out_width + column) * channels;
  for (int e = get_global_id(0) * VW; e < channels; e += get_global_size(0) * VW) {
    if (e + VW <= channels) {
      VSTORE(VLOAD(0, source + e), 0, target + e);
    } else {
      for (int k = e; k < channels; ++k) target[k] = source[k];
    }
  }
}

// The window's indices [x, y] that read index r of an axis.
inline int2 readers(int r, int first, int in, int out) {
  return (int2)(r == 0 ? 0 : max(r - first, 0), r == in - 1 ? out - 1 : min(r - first, out - 1));
}

KERNEL void crop_gradient(IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x, int height, int width, int top,
                          int left, int out_height, int out_width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= width || row >= height) return;
  const int2 rows = readers(row, top, height, out_height), columns = readers(column, left, width, out_width);
  GLOBAL REAL* target = grad_x + ((size_t)row * width + column) * channels;
  for (int e = get_global_id(0) * VW; e < channels; e += get_global_size(0) * VW) {
    const int behind = min(e + VW, channels);
    if (e + VW <= channels) {
      VSTORE((REALV)(0), 0, target + e);
    } else {
      for (int k = e; k < behind; ++k) target[k] = 0;
    }
    for (int i = rows.x; i <= rows.y; ++i)
      for (int j = columns.x; j <= columns.y; ++j) {
        IN REAL* g = grad_y + ((size_t)i * out_width + j) * channels;
        if (e + VW <= channels) {
          VSTORE(VLOAD(0, target + e) + VLOAD(0, g + e), 0, target + e);
        } else {
          for (int k = e; k < behind; ++k) target[k] += g[k];
        }
      }
  }
}
