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
// linear_forward_bf16 and weight_gradient_bf16 are the same on matrix units (matrix_units.clh).
#include "matrix_units.clh"
#include "tile.clh"

#if HAS_BIAS == 2
#define BIAS_OF(row) (bias + (size_t)((row) / bias_rows) * columns)
#else
#define BIAS_OF(row) (bias)
#endif

// On CPUs block_tiles tiles of rows, which stay in the second cache, meet one panel after the other.
#if GPU_FORM
#define TILE_OF_ROWS get_global_id(1)
#define TILE_OF_COLUMNS get_global_id(0)
#else
#define TILE_OF_ROWS (get_global_id(2) * block_tiles + get_global_id(0))
#define TILE_OF_COLUMNS get_global_id(1)
#endif

KERNEL void linear_forward(IN REAL* restrict x, IN REAL* restrict packed, IN REAL* restrict bias,
                           GLOBAL REAL* restrict y, int capacity, int columns, int bias_rows, IN int* count,
                           int block_tiles) {
  const int rows = live_rows(capacity, count);
  const int row = TILE_OF_ROWS * TILE_ROWS, j = TILE_OF_COLUMNS * COLUMNS;
  if (row >= rows || j >= columns) return;
  IN REAL* w = packed + (size_t)(j / PANEL) * PANEL * PACKED_ROWS(INNER) + j % PANEL;
  REALV acc[TILE_ROWS][TILE_VECTORS];
  FOR_TILE_ROWS FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
  if (rows >= TILE_ROWS) {
    // The last tile moves back to whole rows and stores only those that are its own.
    const int first = min(row, rows - TILE_ROWS);
    IN REAL* a = x + (size_t)first * INNER;
    for (int k = 0; k < INNER; ++k) {
      REALV b[TILE_VECTORS];
      FOR_TILE_VECTORS b[v] = VLOAD(v, w + (size_t)k * PANEL);
      ASK_FOR(w + (size_t)(k + AHEAD) * PANEL);
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

// y [m, rows] = x [rows, m]; one work-item per row of x.
KERNEL void transpose(IN REAL* restrict x, GLOBAL REAL* restrict y, int capacity, int m, IN int* count) {
  const int row = get_global_id(0), rows = live_rows(capacity, count);
  if (row >= capacity) return;
  for (int k = 0; k < m; ++k) y[(size_t)k * capacity + row] = row < rows ? x[(size_t)row * m + k] : 0;
}

#if MATRIX_UNITS
#ifndef ROWS
#define ROWS 128
#endif
#define PAIRS PAIRS_OF(INNER)

// A work-item takes ROWS rows through `panels` panels.
KERNEL void linear_forward_bf16(IN float* restrict x, IN uint* restrict packed, IN float* restrict bias,
                                GLOBAL float* restrict y, int capacity, int columns, int bias_rows, IN int* count,
                                int panels) {
  const int rows = live_rows(capacity, count), first = get_global_id(0) * ROWS, live = min(ROWS, rows - first);
  const int begin = get_global_id(1) * panels * PANEL;
  if (live <= 0 || begin >= columns) return;
  uint a[2 * ROWS * PAIRS] ALIGNED;
  float c[BLOCK_ROWS * PANEL] ALIGNED;
  BEGIN_UNITS
  stage_rows(x + (size_t)first * INNER, INNER, INNER, live, a, PAIRS, ROWS * PAIRS, PRODUCTS);
  for (int j = begin; j < min(columns, begin + panels * PANEL); j += PANEL) {
    const Operand w = OPERAND(packed + (size_t)j * 2 * PAIRS, 4 * PANEL, 4 * PAIRS * PANEL, 0, 0);
    for (int block = 0; block < live; block += BLOCK_ROWS) {
      const Operand from = OPERAND(a + block * PAIRS, 4 * PAIRS, 4 * ROWS * PAIRS, 0, 0);
      product(PASS_REGISTERS from, 64 * PAIRS, w, PANEL, PAIRS, 1, 1, PRODUCTS, c, PANEL, 0);
      for (int r = 0; r < min(BLOCK_ROWS, live - block); ++r) {
        const int row = first + block + r;
        float16 acc[TILE_VECTORS];
        FOR_TILE_VECTORS acc[v] = FLOATS(c + r * PANEL + 16 * v);
        store_activated(acc, BIAS_OF(row) + j, y + (size_t)row * columns + j, columns - j);
      }
    }
  }
  END_UNITS
}

// ROWS rows of a and b, whose `live` first exist, as the operands of a^T b.
INLINE void stage_outer(IN float* a, IN float* b, int live, uint* left, uint* right) {
  for (int row = 0; row < ROWS; row += 32) {
    for (int i = 0; i < INNER; i += 16) {
      float16 rows[32];
      for (int r = 0; r < 32; ++r) {
        IN float* source = a + (size_t)(row + r) * INNER;
        rows[r] = row + r >= live ? (float16)(0) : i + 16 <= INNER ? vload16(0, source + i) : sixteen_partial(source, i, INNER);
      }
      stage_transposed(rows, left + i * (ROWS / 2) + row / 2, ROWS / 2, INNER_PADDED * (ROWS / 2), PRODUCTS);
    }
    for (int r = row; r < row + 32; r += 2)
      for (int j = 0; j < OUTER_PADDED; j += 16) {
        float16 x[2];
        uint16 hi, lo;
        for (int k = 0; k < 2; ++k) {
          IN float* source = b + (size_t)(r + k) * OUTER;
          x[k] = r + k >= live ? (float16)(0) : j + 16 <= OUTER ? vload16(0, source + j) : sixteen_partial(source, j, OUTER);
        }
        split_pairs(x[0], x[1], &hi, &lo);
        *(uint16*)(right + r / 2 * OUTER_PADDED + j) = hi;
        *(uint16*)(right + (ROWS + r) / 2 * OUTER_PADDED + j) = lo;
      }
  }
}

// partial [chunks, INNER, OUTER] of a^T b; one work-item per chunk of rows.
KERNEL void weight_gradient_bf16(IN float* restrict a, IN float* restrict b, GLOBAL float* restrict partial, int capacity,
                                 int chunk_rows, IN int* count) {
  const int chunk = get_global_id(0), begin = chunk * chunk_rows;
  const int end = min(begin + chunk_rows, live_rows(capacity, count));
  if (begin >= capacity) return;
  GLOBAL float* sums = partial + (size_t)chunk * INNER * OUTER;
  if (begin >= end)
    for (int i = 0; i < INNER * OUTER; ++i) sums[i] = 0;
  uint left[INNER_PADDED * ROWS] ALIGNED, right[OUTER_PADDED * ROWS] ALIGNED;
  BEGIN_UNITS
  for (int first = begin; first < end; first += ROWS) {
    stage_outer(a + (size_t)first * INNER, b + (size_t)first * OUTER, end - first, left, right);
    for (int i = 0; i < INNER; i += BLOCK_ROWS)
      for (int j = 0; j < OUTER; j += PANEL)
        product_into(PASS_REGISTERS OPERAND(left + i * (ROWS / 2), 2 * ROWS, 2 * INNER_PADDED * ROWS, 0, 0), 32 * ROWS,
                     OPERAND(right + j, 4 * OUTER_PADDED, 2 * ROWS * OUTER_PADDED, 0, 0), PANEL, ROWS / 2, 1, 1, PRODUCTS,
                     sums + (size_t)i * OUTER + j, OUTER, INNER - i, OUTER - j, first > begin);
  }
  END_UNITS
}
#endif
