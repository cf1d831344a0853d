// conv2d: y [out_height, out_width, CO] = f(x [height, width, CI] (*) W [3, 3, CI, CO] + b [CO]), stride 1.
//
//   A work-item keeps a register tile of TILE_ROWS consecutive output pixels x COLUMNS output channels and walks the
//   taps. Per tap, every pixel has its own pointer to the channels that it reads: in the image, mirrored into it
//   (`reflect`), or a row of zeros. So borders and image rows need no special case and no padded copy.
//
//     x  . . . . . . .          acc[r][v] += source[r][k] * W[tap][k][v]
//        . [a b c]d . .    <- the tile {p, q, r, ..} reads a, b, c, .. at tap (0, 0), b, c, d, .. at tap (0, 1)
//        . . p q r . .
//
// Output pixel (i, j) and tap (u, v) read x at (i + u - pad, j + v - pad). The data gradient is the same kernel on the
// output's gradient, with transposed weights and 2 - pad.
#include "tile.clh"

#define FOR_TAPS for (int tap = 0; tap < 9; ++tap)

// A coordinate mirrored at the centres of the first and the last pixel.
inline int mirrored(int i, int extent) {
  const int positive = abs(i);
  return min(positive, 2 * (extent - 1) - positive);
}

KERNEL void conv2d_forward(IN REAL* restrict x, IN REAL* restrict packed, IN REAL* restrict bias,
                           IN REAL* restrict zeros, GLOBAL REAL* restrict y, int height, int width, int out_height,
                           int out_width, int columns, int pad, int reflect, int panel_rows) {
  const int pixels = out_height * out_width;
  const int pixel = get_global_id(0) * TILE_ROWS, j = get_global_id(1) * COLUMNS;
  if (pixel >= pixels || j >= columns) return;
  // The last tile moves back to whole rows and stores only those that are its own.
  const int first = max(0, min(pixel, pixels - TILE_ROWS));
  int top[TILE_ROWS], left[TILE_ROWS];
  FOR_TILE_ROWS {
    const int p = min(first + r, pixels - 1);
    top[r] = p / out_width - pad;
    left[r] = p % out_width - pad;
  }
  IN REAL* w = packed + (size_t)(j / PANEL) * PANEL * panel_rows + j % PANEL;
  REALV acc[TILE_ROWS][TILE_VECTORS];
  FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
  FOR_TAPS {
    IN REAL* source[TILE_ROWS];
    FOR_TILE_ROWS {
      int i = top[r] + tap / 3, k = left[r] + tap % 3;
      if (reflect) {
        i = mirrored(i, height);
        k = mirrored(k, width);
      }
      const bool inside = (uint)i < (uint)height && (uint)k < (uint)width;
      source[r] = inside ? x + (size_t)(i * width + k) * INNER : zeros;
    }
    for (int k = 0; k < INNER; ++k) {
      REALV b[TILE_VECTORS];
      FOR_TILE_VECTORS b[v] = VLOAD(v, w + (size_t)k * PANEL);
      FOR_TILE_ROWS {
        const REAL s = source[r][k];
        FOR_TILE_VECTORS acc[r][v] += s * b[v];
      }
    }
    w += (size_t)INNER * PANEL;
  }
  FOR_TILE_ROWS if (first + r >= pixel && first + r < pixels)
      store_activated(acc[r], bias + j, y + (size_t)(first + r) * columns + j, columns - j);
}

// The gradient of mirroring: grad [height, width, C] = the sum of padded [height + 2, width + 2, C] over the pixels
// that show the same image pixel. One work-item per image pixel.
KERNEL void fold_reflection(IN REAL* restrict padded, GLOBAL REAL* restrict grad, int height, int width,
                            int channels) {
  const int pixel = get_global_id(0);
  if (pixel >= height * width) return;
  const int i = pixel / width, j = pixel % width;
  // Padded rows that show row i: its own, the one above row 0 if i is row 1, the one below the last if i is last but one.
  const int rows[3] = {i + 1, i == 1 ? 0 : -1, i == height - 2 ? height + 1 : -1};
  const int columns[3] = {j + 1, j == 1 ? 0 : -1, j == width - 2 ? width + 1 : -1};
  GLOBAL REAL* out = grad + (size_t)pixel * channels;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      if (rows[a] < 0 || columns[b] < 0) continue;
      IN REAL* in = padded + (size_t)(rows[a] * (width + 2) + columns[b]) * channels;
      for (int c = 0; c < channels; ++c) out[c] = a + b == 0 ? in[c] : out[c] + in[c];
    }
}

// The weight gradient: per tap, A^T B over a chunk of output rows -> partial [chunks, 9, m, n]. A is x moved by the
// tap and B the output's gradient; SWAPPED: the other way round. A work-item has a tile of one tap's m x n.
#ifndef SWAPPED
#define SWAPPED 0
#endif
#define ACCUMULATE(LOAD)                                                         \
  for (int k = begin; k < end; ++k) {                                            \
    const int at = reflect ? mirrored(k + shift, width) : k + shift;             \
    IN REAL* moved = x_row + (size_t)at * (SWAPPED ? n : m);                     \
    IN REAL* fixed = grad_row + (size_t)k * (SWAPPED ? m : n);                   \
    IN REAL* a = (SWAPPED ? fixed : moved) + i;                                  \
    IN REAL* b = (SWAPPED ? moved : fixed) + j;                                  \
    REALV values[TILE_VECTORS];                                                  \
    FOR_TILE_VECTORS values[v] = LOAD;                                           \
    FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] += a[r] * values[v];                \
  }

KERNEL void conv2d_weight_gradient(IN REAL* restrict x, IN REAL* restrict grad, GLOBAL REAL* restrict partial,
                                   int height, int width, int out_height, int out_width, int m, int n, int pad,
                                   int reflect, int chunk_rows) {
  const int tiles = (m + TILE_ROWS - 1) / TILE_ROWS;
  const int tap = get_global_id(0) / tiles, own = get_global_id(0) % tiles * TILE_ROWS;
  const int j = get_global_id(1) * COLUMNS, chunk = get_global_id(2), shift = tap % 3 - pad;
  if (tap >= 9 || j >= n || chunk * chunk_rows >= out_height) return;
  const int i = min(own, m - TILE_ROWS);
  // Without mirroring, the output columns whose tap lies outside of the image get nothing from it.
  const int begin = reflect ? 0 : max(0, -shift), end = reflect ? out_width : min(out_width, width - shift);
  REALV acc[TILE_ROWS][TILE_VECTORS];
  FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
  for (int row = chunk * chunk_rows; row < min((chunk + 1) * chunk_rows, out_height); ++row) {
    const int shifted = row + tap / 3 - pad, source = reflect ? mirrored(shifted, height) : shifted;
    if (source < 0 || source >= height) continue;
    IN REAL* x_row = x + (size_t)source * width * (SWAPPED ? n : m);
    IN REAL* grad_row = grad + (size_t)row * out_width * (SWAPPED ? m : n);
    if (j + COLUMNS <= n)
      ACCUMULATE(VLOAD(v, b))
    else
      ACCUMULATE(load_partial(b, v, n - j))
  }
  GLOBAL REAL* out = partial + ((size_t)chunk * 9 + tap) * m * n;
  FOR_TILE_ROWS if (i + r >= own) store_columns(acc[r], out + (size_t)(i + r) * n + j, n - j);
}
