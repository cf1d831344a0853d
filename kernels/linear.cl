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
#include "activation.clh"

#ifndef INNER
#define INNER 32
#endif
#ifndef PANEL
#define PANEL 64
#endif
#ifndef TILE_ROWS
#define TILE_ROWS 6
#endif
#ifndef TILE_VECTORS
#define TILE_VECTORS 4
#endif
#ifndef HAS_BIAS
#define HAS_BIAS 1
#endif
#define COLUMNS (VW * TILE_VECTORS)

#define FOR_TILE_ROWS UNROLL for (int r = 0; r < TILE_ROWS; ++r)
#define FOR_TILE_VECTORS UNROLL for (int v = 0; v < TILE_VECTORS; ++v)

// f(acc + bias) of one row into y + j, of which `left` columns exist.
inline void store_columns(REALV* acc, IN REAL* bias, GLOBAL REAL* y, int left) {
  if (left >= COLUMNS) {
    FOR_TILE_VECTORS {
#if HAS_BIAS
      const REALV value = acc[v] + VLOAD(v, bias);
#else
      const REALV value = acc[v];
#endif
      VSTORE(ACTIVATE(REALV, value), v, y);
    }
  } else {
    REAL columns[COLUMNS];
    FOR_TILE_VECTORS VSTORE(acc[v], v, columns);
    for (int c = 0; c < left; ++c) {
#if HAS_BIAS
      const REAL value = columns[c] + bias[c];
#else
      const REAL value = columns[c];
#endif
      y[c] = ACTIVATE(REAL, value);
    }
  }
}

#if HAS_BIAS == 2
#define BIAS_OF(row) (bias + (size_t)((row) / bias_rows) * columns)
#else
#define BIAS_OF(row) (bias)
#endif

KERNEL void linear_forward(IN REAL* restrict x, IN REAL* restrict packed, IN REAL* restrict bias,
                           GLOBAL REAL* restrict y, int capacity, int columns, int bias_rows, IN int* count) {
  const int rows = live_rows(capacity, count);
  const int row = get_global_id(0) * TILE_ROWS, j = get_global_id(1) * COLUMNS;
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
        store_columns(acc[r], BIAS_OF(first + r) + j, y + (size_t)(first + r) * columns + j, columns - j);
  } else {
    for (int i = 0; i < rows; ++i) {
      FOR_TILE_VECTORS acc[0][v] = (REALV)(0);
      for (int k = 0; k < INNER; ++k)
        FOR_TILE_VECTORS acc[0][v] += x[i * INNER + k] * VLOAD(v, w + (size_t)k * PANEL);
      store_columns(acc[0], BIAS_OF(i) + j, y + (size_t)i * columns + j, columns - j);
    }
  }
}

// partial [chunks, M, N] of A^T B, A [rows, M], B [rows, N]; one work-item per tile of M x N and chunk of rows.
KERNEL void weight_gradient(IN REAL* restrict a, IN REAL* restrict b, GLOBAL REAL* restrict partial, int capacity,
                            int m, int n, int chunk_rows, IN int* count) {
  const int i = get_global_id(0) * TILE_ROWS, j = get_global_id(1) * COLUMNS, chunk = get_global_id(2);
  const int first = chunk * chunk_rows, end = min(first + chunk_rows, live_rows(capacity, count));
  if (i >= m || j >= n) return;
  GLOBAL REAL* out = partial + (size_t)chunk * m * n;
  if (m >= TILE_ROWS && j + COLUMNS <= n) {
    const int top = min(i, m - TILE_ROWS);
    REALV acc[TILE_ROWS][TILE_VECTORS];
    FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
    for (int row = first; row < end; ++row) {
      IN REAL* s = a + (size_t)row * m + top;
      IN REAL* t = b + (size_t)row * n + j;
      REALV values[TILE_VECTORS];
      FOR_TILE_VECTORS values[v] = VLOAD(v, t);
      FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] += s[r] * values[v];
    }
    FOR_TILE_ROWS if (top + r >= i) FOR_TILE_VECTORS VSTORE(acc[r][v], v, out + (size_t)(top + r) * n + j);
  } else {
    for (int r = i; r < min(i + TILE_ROWS, m); ++r)
      for (int c = j; c < min(j + COLUMNS, n); ++c) {
        REAL sum = 0;
        for (int row = first; row < end; ++row) sum += a[(size_t)row * m + r] * b[(size_t)row * n + c];
        out[(size_t)r * n + c] = sum;
      }
  }
}

// y [M, N] = the sum of partial [chunks, M, N], or its transpose [N, M].
KERNEL void sum_weight_partials(IN REAL* restrict partial, GLOBAL REAL* restrict y, int chunks, int m, int n,
                                int transposed) {
  const int e = get_global_id(0);
  if (e >= m * n) return;
  REAL sum = 0;
  for (int k = 0; k < chunks; ++k) sum += partial[(size_t)k * m * n + e];
  y[transposed ? (e % n) * m + e / n : e] = sum;
}
