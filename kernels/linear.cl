// linear: y [rows, N] = f(x [rows, K] . W [K, N] + b [N]), rows and channels contiguous.
//
//   W is packed in panels of PANEL columns, [N / PANEL][K][PANEL], zeros behind the last column. A work-item keeps a
//   register tile of TILE_ROWS x COLUMNS (COLUMNS = VW * TILE_VECTORS) and walks k:
//
//        k ->          panel
//     x [####]  .   [ ######## ]  k    acc[r][v] += x[r][k] * W[k][v]
//
// HAS_BIAS: 0 none, 1 one bias [N], 2 a bias [G, N] whose row g serves rows / G rows in turn (a per-ray term).
//
// The weight gradient is the same tile over rows: acc[k][v] += a[row][k] * b[row][v].
#include "tile.clh"

#if HAS_BIAS == 2
#define BIAS_OF(row) (bias + (size_t)((row) / bias_rows) * columns)
#else
#define BIAS_OF(row) (bias)
#endif

KERNEL void linear_forward(IN REAL* restrict x, IN REAL* restrict packed, IN REAL* restrict bias,
                           GLOBAL REAL* restrict y, int capacity, int columns, int bias_rows, IN int* count) {
  const int rows = live_rows(capacity, count);
  const int row = get_global_id(1) * TILE_ROWS, j = get_global_id(0) * COLUMNS;
  if (row >= rows || j >= columns) return;
  IN REAL* w = packed + (size_t)(j / PANEL) * PANEL * INNER + j % PANEL;
  REALV acc[TILE_ROWS][TILE_VECTORS];
  FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
  if (rows >= TILE_ROWS) {
    // The last tile moves back to whole rows and stores only those that are its own.
    const int first = min(row, rows - TILE_ROWS);
    IN REAL* a = x + (size_t)first * INNER;
    for (int k = 0; k < INNER; ++k) {
      REALV b[TILE_VECTORS];
      FOR_TILE_VECTORS b[v] = VLOAD(v, w + (size_t)k * PANEL);
      FOR_TILE_ROWS {
        const REAL s = a[r * INNER + k];
        FOR_TILE_VECTORS acc[r][v] += s * b[v];
      }
    }
    FOR_TILE_ROWS if (first + r >= row)
        store_activated(acc[r], BIAS_OF(first + r) + j, y + (size_t)(first + r) * columns + j, columns - j);
  } else {
    for (int i = 0; i < rows; ++i) {
      FOR_TILE_VECTORS acc[0][v] = (REALV)(0);
      for (int k = 0; k < INNER; ++k)
        FOR_TILE_VECTORS acc[0][v] += x[i * INNER + k] * VLOAD(v, w + (size_t)k * PANEL);
      store_activated(acc[0], BIAS_OF(i) + j, y + (size_t)i * columns + j, columns - j);
    }
  }
}

// partial [chunks, m, n] of A^T B, A [rows, m], B [rows, n]; one work-item per tile of m x n and chunk of rows.
// PACKED: A in panels of TILE_ROWS columns and B in panels of PANEL, which are read from front to back.
#ifndef PACKED
#define PACKED 0
#endif
#if PACKED
#define ROW_OF_A(row) (a + ((size_t)(i / TILE_ROWS) * capacity + row) * TILE_ROWS)
#define ROW_OF_B(row) (b + ((size_t)(j / PANEL) * capacity + row) * PANEL + j % PANEL)
#else
#define ROW_OF_A(row) (a + (size_t)row * m + top)
#define ROW_OF_B(row) (b + (size_t)row * n + j)
#endif
#define ACCUMULATE(LOAD)                                            \
  for (int row = first; row < end; ++row) {                         \
    IN REAL* s = ROW_OF_A(row);                                     \
    IN REAL* t = ROW_OF_B(row);                                     \
    REALV values[TILE_VECTORS];                                     \
    FOR_TILE_VECTORS values[v] = LOAD;                              \
    FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] += s[r] * values[v];   \
  }

KERNEL void weight_gradient(IN REAL* restrict a, IN REAL* restrict b, GLOBAL REAL* restrict partial, int capacity,
                            int m, int n, int chunk_rows, IN int* count) {
  const int i = get_global_id(0) * TILE_ROWS, j = get_global_id(1) * COLUMNS, chunk = get_global_id(2);
  const int first = chunk * chunk_rows, end = min(first + chunk_rows, live_rows(capacity, count));
  if (i >= m || j >= n || first >= capacity) return;
  const int top = PACKED ? i : min(i, m - TILE_ROWS);
  REALV acc[TILE_ROWS][TILE_VECTORS];
  FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
  if (PACKED || j + COLUMNS <= n)
    ACCUMULATE(VLOAD(v, t))
  else
    ACCUMULATE(load_partial(t, v, n - j))
  GLOBAL REAL* out = partial + (size_t)chunk * m * n;
  FOR_TILE_ROWS if (top + r >= i && top + r < m) store_columns(acc[r], out + (size_t)(top + r) * n + j, n - j);
}

// y [taps, n, m] = the transposed sum of partial [chunks, taps, m, n].
KERNEL void transpose_weight_partials(IN REAL* restrict partial, GLOBAL REAL* restrict y, int chunks, int taps, int m,
                                      int n) {
  const int e = get_global_id(0), elements = taps * m * n;
  if (e >= elements) return;
  REAL sum = 0;
  for (int k = 0; k < chunks; ++k) sum += partial[(size_t)k * elements + e];
  const int tap = e / (m * n), within = e % (m * n);
  y[tap * m * n + within % n * m + within / n] = sum;
}
