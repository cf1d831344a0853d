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
// output's gradient, with transposed weights and 2 - pad. Forms on matrix units (matrix_units.clh) end in _bf16.
#include "matrix_units.clh"
#include "mirrored.clh"
#include "tile.clh"

#define FOR_TAPS for (int tap = 0; tap < 9; ++tap)

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

#if MATRIX_UNITS
// Pixels of a block, BLOCK_WIDTH 16 or 32; the block's inputs have a border of one pixel.
#ifndef BLOCK_WIDTH
#define BLOCK_WIDTH 32
#endif
#ifndef BLOCK_HEIGHT
#define BLOCK_HEIGHT 4
#endif
#define PAIRS PAIRS_OF(INNER)
#define STAGED_WIDTH (BLOCK_WIDTH + 2)
#define STAGED ((BLOCK_HEIGHT + 2) * STAGED_WIDTH * PAIRS)

// The image pixel at (i, k), mirrored if need be, or a null pointer outside.
INLINE IN float* pixel_at(IN float* x, int i, int k, int height, int width, int channels, int reflect) {
  if (reflect) {
    i = mirrored(i, height);
    k = mirrored(k, width);
  }
  return (uint)i < (uint)height && (uint)k < (uint)width ? x + (size_t)(i * width + k) * channels : 0;
}

// A work-item takes a block of pixels through `panels` panels.
KERNEL void conv2d_forward_bf16(IN float* restrict x, IN uint* restrict packed, IN float* restrict bias,
                                GLOBAL float* restrict y, int height, int width, int out_height, int out_width,
                                int columns, int pad, int reflect, int panels) {
  const int across = (out_width + BLOCK_WIDTH - 1) / BLOCK_WIDTH, begin = get_global_id(1) * panels * PANEL;
  const int left = get_global_id(0) % across * BLOCK_WIDTH, top = get_global_id(0) / across * BLOCK_HEIGHT;
  if (top >= out_height || begin >= columns) return;
  uint a[2 * STAGED] ALIGNED;
  float c[BLOCK_ROWS * PANEL] ALIGNED;
  BEGIN_UNITS
  for (int i = 0; i < BLOCK_HEIGHT + 2; ++i)
    for (int k = 0; k < STAGED_WIDTH; ++k) {
      IN float* pixel = pixel_at(x, top + i - pad, left + k - pad, height, width, INNER, reflect);
      stage_rows(pixel, 0, pixel ? INNER : 0, 1, a + (i * STAGED_WIDTH + k) * PAIRS, PAIRS, STAGED, PRODUCTS);
    }
  const int rows = BLOCK_ROWS / BLOCK_WIDTH, second = 4 * PAIRS * (BLOCK_WIDTH == 16 ? STAGED_WIDTH : 16);
  for (int j = begin; j < min(columns, begin + panels * PANEL); j += PANEL) {
    const Operand w = OPERAND(packed + (size_t)j * 18 * PAIRS, 4 * PANEL, 36 * PAIRS * PANEL, 4 * PAIRS * PANEL,
                              12 * PAIRS * PANEL);
    for (int i = 0; i < min(BLOCK_HEIGHT, out_height - top); i += rows) {
      const Operand pixels = OPERAND(a + i * STAGED_WIDTH * PAIRS, 4 * PAIRS, 4 * STAGED, 4 * PAIRS, 4 * PAIRS * STAGED_WIDTH);
      product(PASS_REGISTERS pixels, second, w, PANEL, PAIRS, 9, 3, PRODUCTS, c, PANEL, 0);
      for (int r = 0; r < BLOCK_ROWS; ++r) {
        const int row = top + i + r / BLOCK_WIDTH, column = left + r % BLOCK_WIDTH;
        if (row >= out_height || column >= out_width) continue;
        float16 acc[TILE_VECTORS];
        FOR_TILE_VECTORS acc[v] = FLOATS(c + r * PANEL + 16 * v);
        store_activated(acc, bias + j, y + (size_t)(row * out_width + column) * columns + j, columns - j);
      }
    }
  }
  END_UNITS
}

// Columns of a span, and those of x that they and their taps read.
#ifndef SPAN
#define SPAN 64
#endif
#define SPAN_OF_X (SPAN + 32)
#define LEFT_PAIRS ((BLOCK_HEIGHT + 2) * INNER_PADDED * (SPAN_OF_X / 2))
#define RIGHT_PAIRS (BLOCK_HEIGHT * (SPAN / 2) * OUTER_PADDED)

INLINE float16 sixteen_of_pixel(IN float* pixel, int c, int channels) {
  return !pixel ? (float16)(0) : c + 16 <= channels ? vload16(0, pixel + c) : sixteen_partial(pixel, c, channels);
}

// x from pixel (top, left) on: left [row][channel][pairs of columns]
INLINE void stage_inputs(IN float* x, int top, int left_column, int height, int width, int reflect, uint* left) {
  for (int i = 0; i < BLOCK_HEIGHT + 2; ++i)
    for (int k = 0; k < SPAN_OF_X; k += 32) {
      IN float* pixels[32];
      for (int p = 0; p < 32; ++p)
        pixels[p] = pixel_at(x, top + i, left_column + k + p, height, width, INNER, reflect);
      for (int c = 0; c < INNER; c += 16) {
        float16 rows[32];
        for (int p = 0; p < 32; ++p) rows[p] = sixteen_of_pixel(pixels[p], c, INNER);
        stage_transposed(rows, left + (i * INNER_PADDED + c) * (SPAN_OF_X / 2) + k / 2, SPAN_OF_X / 2, LEFT_PAIRS, PRODUCTS);
      }
    }
}

// The output's gradient from pixel (top, left) on: right [row][pairs of columns][channel]
INLINE void stage_gradients(IN float* grad, int top, int left_column, int height, int width, uint* right) {
  for (int i = 0; i < BLOCK_HEIGHT; ++i)
    for (int k = 0; k < SPAN; k += 2) {
      IN float* first = pixel_at(grad, top + i, left_column + k, height, width, OUTER, 0);
      IN float* second = pixel_at(grad, top + i, left_column + k + 1, height, width, OUTER, 0);
      uint* to = right + (i * SPAN + k) / 2 * OUTER_PADDED;
      for (int c = 0; c < OUTER_PADDED; c += 16) {
        uint16 hi, lo;
        split_pairs(sixteen_of_pixel(first, c, OUTER), sixteen_of_pixel(second, c, OUTER), &hi, &lo);
        *(uint16*)(to + c) = hi;
        *(uint16*)(to + RIGHT_PAIRS + c) = lo;
      }
    }
}

// partial [chunks, 9, INNER, OUTER]: one work-item per chunk of output rows.
KERNEL void conv2d_weight_gradient_bf16(IN float* restrict x, IN float* restrict grad, GLOBAL float* restrict partial,
                                        int height, int width, int out_height, int out_width, int pad, int reflect,
                                        int chunk_rows) {
  const int chunk = get_global_id(0), begin = chunk * chunk_rows, end = min(begin + chunk_rows, out_height);
  if (begin >= out_height) return;
  GLOBAL float* sums = partial + (size_t)chunk * 9 * INNER * OUTER;
  uint left[2 * LEFT_PAIRS] ALIGNED, right[2 * RIGHT_PAIRS] ALIGNED;
  BEGIN_UNITS
  for (int top = begin; top < end; top += BLOCK_HEIGHT)
    for (int column = 0; column < out_width; column += SPAN) {
      // Rows below the chunk's have no gradient here: those of other chunks are not taken twice.
      stage_inputs(x, top - pad, column - pad, height, width, reflect, left);
      stage_gradients(grad, top, column, end, out_width, right);
      for (int tap = 0; tap < 9; ++tap)
        for (int i = 0; i < INNER; i += BLOCK_ROWS)
          for (int j = 0; j < OUTER; j += PANEL) {
            const int row = 2 * SPAN_OF_X;  // bytes of a channel's columns
            const Operand a = OPERAND((ulong)(left + (tap / 3 * INNER_PADDED + i) * (SPAN_OF_X / 2)) + 2 * (tap % 3), row,
                                      4 * LEFT_PAIRS, INNER_PADDED * row, 0);
            const Operand b = OPERAND(right + j, 4 * OUTER_PADDED, 4 * RIGHT_PAIRS, 2 * SPAN * OUTER_PADDED, 0);
            product_into(PASS_REGISTERS a, 16 * row, b, PANEL, SPAN / 2, BLOCK_HEIGHT, BLOCK_HEIGHT, PRODUCTS,
                         sums + ((size_t)tap * INNER + i) * OUTER + j, OUTER, INNER - i, OUTER - j,
                         top > begin || column > 0);
          }
    }
  END_UNITS
}
#endif
