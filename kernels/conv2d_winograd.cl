// conv2d_winograd: the convolution of conv2d.cl by Winograd's algorithm (winograd.clh). CPU form alone.
//
//   A work-item takes TILES tiles of 4x4 output pixels:
//     v [36][TILES][INNER]     its 6x6 inputs per tile, transformed, in a buffer of its own
//     m [36][TILES][COLUMNS]   36 products v[p] . U[p] with the packed weights U [panel][36][INNER][PANEL]
//     y                        per tile, m transformed to 4x4 pixels, bias and activation
#include "mirrored.clh"
#include "tile.clh"
#include "winograd.clh"
#ifndef TILES
#define TILES 24
#endif
#define POINTS 36

// The 6x6 pixels of the tile whose first input pixel is (top, left).
inline void pixels_of_tile(IN REAL* restrict x, IN REAL* restrict zeros, int height, int width, int top, int left,
                           int reflect, IN REAL** source) {
  const bool inside_all = top >= 0 && left >= 0 && top + 6 <= height && left + 6 <= width;
  for (int i = 0; inside_all && i < 6; ++i)
    for (int k = 0; k < 6; ++k) source[i * 6 + k] = x + (size_t)((top + i) * width + left + k) * INNER;
  for (int i = 0; !inside_all && i < 6; ++i)
    for (int k = 0; k < 6; ++k) {
      const int row = reflect ? mirrored(top + i, height) : top + i, column = reflect ? mirrored(left + k, width) : left + k;
      const bool inside = (uint)row < (uint)height && (uint)column < (uint)width;
      source[i * 6 + k] = inside ? x + (size_t)(row * width + column) * INNER : zeros;
    }
}

// v[.][tile] of that tile.
inline void transform_inputs(IN REAL* restrict x, IN REAL* restrict zeros, int height, int width, int top, int left,
                             int reflect, REAL* v) {
  IN REAL* source[POINTS];
  pixels_of_tile(x, zeros, height, width, top, left, reflect, source);
  for (int c = 0; c < INNER; c += VW) {
    REALV rows[POINTS];
    UNROLL for (int k = 0; k < 6; ++k) {
      REALV d[6];
      UNROLL for (int i = 0; i < 6; ++i) d[i] = *(IN REALV*)(source[i * 6 + k] + c);
      INPUT_TRANSFORM(REALV, d, d)
      UNROLL for (int i = 0; i < 6; ++i) rows[i * 6 + k] = d[i];
    }
    UNROLL for (int i = 0; i < 6; ++i) {
      INPUT_TRANSFORM(REALV, rows + 6 * i, rows + 6 * i)
      UNROLL for (int k = 0; k < 6; ++k) AT(v + (i * 6 + k) * TILES * INNER + c, 0) = rows[6 * i + k];
    }
  }
}

// m [TILES][COLUMNS] = v [TILES][INNER] . panel [INNER][PANEL]
inline void multiply(const REAL* v, IN REAL* panel, REAL* m) {
  for (int first = 0; first < TILES; first += TILE_ROWS) {
    REALV acc[TILE_ROWS][TILE_VECTORS];
    FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
    const REAL* rows = v + first * INNER;
    for (int k = 0; k < INNER; ++k) {
      REALV b[TILE_VECTORS];
      FOR_TILE_VECTORS b[v] = VLOAD(v, panel + (size_t)k * PANEL);
      ASK_FOR(panel + (size_t)(k + AHEAD) * PANEL);
      FOR_TILE_ROWS {
        const REAL s = rows[r * INNER + k];
        FOR_TILE_VECTORS acc[r][v] += s * b[v];
      }
    }
    FOR_TILE_ROWS FOR_TILE_VECTORS AT(m + (first + r) * COLUMNS, v) = acc[r][v];
  }
}

// 4x4 pixels of the tile whose first output pixel is (top, left).
inline void transform_outputs(const REAL* m, IN REAL* restrict bias, GLOBAL REAL* restrict y, int out_height,
                              int out_width, int columns, int j, int top, int left) {
  REALV pixels[16][TILE_VECTORS];
  FOR_TILE_VECTORS {
    REALV half_way[4 * 6], out[4];
    UNROLL for (int k = 0; k < 6; ++k) {
      REALV rows[6];
      UNROLL for (int i = 0; i < 6; ++i) rows[i] = AT(m + (i * 6 + k) * TILES * COLUMNS, v);
      OUTPUT_TRANSFORM(REALV, rows, half_way + k, 6)
    }
    UNROLL for (int i = 0; i < 4; ++i) {
      OUTPUT_TRANSFORM(REALV, half_way + 6 * i, out, 1)
      UNROLL for (int k = 0; k < 4; ++k) pixels[4 * i + k][v] = out[k];
    }
  }
  for (int i = 0; i < min(4, out_height - top); ++i)
    for (int k = 0; k < min(4, out_width - left); ++k)
      store_activated(pixels[4 * i + k], bias + j, y + (size_t)((top + i) * out_width + left + k) * columns + j, columns - j);
}

KERNEL void conv2d_winograd(IN REAL* restrict x, IN REAL* restrict packed, IN REAL* restrict bias,
                            IN REAL* restrict zeros, GLOBAL REAL* restrict y, int height, int width, int out_height,
                            int out_width, int columns, int pad, int reflect, int panels) {
  const int across = (out_width + 3) / 4, tiles = across * ((out_height + 3) / 4);
  const int first = get_global_id(0) * TILES, begin = get_global_id(1) * panels * PANEL;
  if (first >= tiles || begin >= columns) return;
  REAL v[POINTS * TILES * INNER] ALIGNED, m[POINTS * TILES * COLUMNS] ALIGNED;
  for (int t = 0; t < TILES; ++t) {
    const int tile = min(first + t, tiles - 1);
    transform_inputs(x, zeros, height, width, tile / across * 4 - pad, tile % across * 4 - pad, reflect, v + t * INNER);
  }
  for (int j = begin; j < min(columns, begin + panels * PANEL); j += PANEL) {
    for (int p = 0; p < POINTS; ++p)
      multiply(v + p * TILES * INNER, packed + ((size_t)(j / PANEL) * POINTS + p) * INNER * PANEL, m + p * TILES * COLUMNS);
    for (int t = 0; t < min(TILES, tiles - first); ++t)
      transform_outputs(m + t * COLUMNS, bias, y, out_height, out_width, columns, j, (first + t) / across * 4,
                        (first + t) % across * 4);
  }
}

// The weight gradient: a work-item has a chunk of tiles, BLOCK of the input channels and one row of the 6x6 points,
// whose sums then stay in the second cache while TILES tiles after the other are added.
#ifndef OUTER
#define OUTER 32
#endif
#ifndef BLOCK
#define BLOCK 32
#endif
// A cache line more than the channels: rows a power of two apart share one set of a cache.
#define V_STRIDE (BLOCK + VW)
#define G_STRIDE (OUTER + VW)

// Points of row i, v [6][tile], of the 6x6 inputs of which the first is (top, left), channels from `first` on.
inline void transform_input_row(IN REAL* restrict x, IN REAL* restrict zeros, int height, int width, int top, int left,
                                int reflect, int i, int first, REAL* v) {
  IN REAL* source[POINTS];
  pixels_of_tile(x + first, zeros, height, width, top, left, reflect, source);
  for (int c = 0; c < BLOCK; c += VW) {
    REALV points[6];
    UNROLL for (int k = 0; k < 6; ++k) points[k] = (REALV)(0);
    for (int r = i != 0; r < 5 + (i == 5); ++r)
      UNROLL for (int k = 0; k < 6; ++k) points[k] += input_rows[i][r] * *(IN REALV*)(source[r * 6 + k] + c);
    INPUT_TRANSFORM(REALV, points, points)
    UNROLL for (int k = 0; k < 6; ++k) AT(v + k * TILES * V_STRIDE + c, 0) = points[k];
  }
}

// The same of the 4x4 pixels of the output's gradient from (top, left) on: g [6][tile].
inline void transform_gradient_row(IN REAL* restrict grad, IN REAL* restrict zeros, int height, int width, int top,
                                   int left, int i, REAL* g) {
  IN REAL* source[16];
  const bool inside_all = top + 4 <= height && left + 4 <= width;
  for (int r = 0; inside_all && r < 4; ++r)
    for (int k = 0; k < 4; ++k) source[r * 4 + k] = grad + (size_t)((top + r) * width + left + k) * OUTER;
  for (int r = 0; !inside_all && r < 4; ++r)
    for (int k = 0; k < 4; ++k) {
      const bool inside = top + r < height && left + k < width;
      source[r * 4 + k] = inside ? grad + (size_t)((top + r) * width + left + k) * OUTER : zeros;
    }
  for (int c = 0; c < OUTER; c += VW) {
    REALV pixels[4], points[6];
    UNROLL for (int k = 0; k < 4; ++k) pixels[k] = (REALV)(0);
    for (int r = i == 5 ? 3 : 0; r < (i == 0 ? 1 : 4); ++r)
      UNROLL for (int k = 0; k < 4; ++k) pixels[k] += gradient_rows[i][r] * *(IN REALV*)(source[r * 4 + k] + c);
    OUTPUT_GRADIENT(REALV, pixels, points)
    UNROLL for (int k = 0; k < 6; ++k) AT(g + k * TILES * G_STRIDE + c, 0) = points[k];
  }
}

// sums [BLOCK][OUTER] of rows [TILES][BLOCK]^T g [TILES][OUTER], added to what is there but for the first ones.
inline void add_products(const REAL* rows, const REAL* g, GLOBAL REAL* sums, bool first) {
  for (int i = 0; i < BLOCK; i += TILE_ROWS)
    for (int j = 0; j < OUTER; j += COLUMNS) {
      const int top = min(i, BLOCK - TILE_ROWS);  // the last tile moves back and stores only the rows that are its own
      REALV acc[TILE_ROWS][TILE_VECTORS];
      FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
      if (!first) FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = VLOAD(v, sums + (size_t)(top + r) * OUTER + j);
      for (int t = 0; t < TILES; ++t) {
        REALV b[TILE_VECTORS];
        FOR_TILE_VECTORS b[v] = AT(g + t * G_STRIDE + j, v);
        FOR_TILE_ROWS {
          const REAL s = rows[t * V_STRIDE + top + r];
          FOR_TILE_VECTORS acc[r][v] += s * b[v];
        }
      }
      FOR_TILE_ROWS if (top + r >= i) FOR_TILE_VECTORS VSTORE(acc[r][v], v, sums + (size_t)(top + r) * OUTER + j);
    }
}

// partial [chunks][36][INNER][OUTER]: one work-item per row of points, block of input channels and chunk of tiles.
KERNEL void conv2d_winograd_gradient(IN REAL* restrict x, IN REAL* restrict grad, IN REAL* restrict zeros,
                                     GLOBAL REAL* restrict partial, int height, int width, int out_height,
                                     int out_width, int pad, int reflect, int chunk_tiles) {
  const int across = (out_width + 3) / 4, tiles = across * ((out_height + 3) / 4);
  const int i = get_global_id(0), block = get_global_id(1) * BLOCK, chunk = get_global_id(2);
  const int begin = chunk * chunk_tiles, end = min(begin + chunk_tiles, tiles);
  if (i >= 6 || block >= INNER || begin >= tiles) return;
  GLOBAL REAL* sums = partial + (((size_t)chunk * POINTS + i * 6) * INNER + block) * OUTER;
  REAL v[6 * TILES * V_STRIDE] ALIGNED, g[6 * TILES * G_STRIDE] ALIGNED;
  for (int first = begin; first < end; first += TILES) {
    for (int t = 0; t < TILES; ++t) {
      const int tile = min(first + t, end - 1), top = tile / across * 4, left = tile % across * 4;
      transform_input_row(x, zeros, height, width, top - pad, left - pad, reflect, i, block, v + t * V_STRIDE);
      // A tile too many: one outside of the picture, whose gradient is 0.
      transform_gradient_row(grad, zeros, out_height, out_width, first + t < end ? top : out_height, left, i,
                             g + t * G_STRIDE);
    }
    for (int k = 0; k < 6; ++k)
      add_products(v + k * TILES * V_STRIDE, g + k * TILES * G_STRIDE, sums + (size_t)k * INNER * OUTER, first == begin);
  }
}

// grad_w [3, 3, INNER, OUTER] = the chunks' sum, one after the other, transformed back.
KERNEL void conv2d_winograd_weights(IN REAL* restrict partial, GLOBAL REAL* restrict grad_w, int chunks) {
  const int k = get_global_id(1), c = get_global_id(0) * VW;
  if (k >= INNER || c >= OUTER) return;
  REALV half_way[3 * 6], taps[9];
  UNROLL for (int j = 0; j < 6; ++j) {
    REALV points[6];
    UNROLL for (int i = 0; i < 6; ++i) {
      points[i] = (REALV)(0);
      for (int chunk = 0; chunk < chunks; ++chunk)
        points[i] += *(IN REALV*)(partial + (((size_t)chunk * POINTS + i * 6 + j) * INNER + k) * OUTER + c);
    }
    WEIGHT_GRADIENT(REALV, points, half_way + j, 6)
  }
  UNROLL for (int i = 0; i < 3; ++i) WEIGHT_GRADIENT(REALV, half_way + 6 * i, taps + 3 * i, 1)
  UNROLL for (int tap = 0; tap < 9; ++tap) *(GLOBAL REALV*)(grad_w + ((size_t)tap * INNER + k) * OUTER + c) = taps[tap];
}
