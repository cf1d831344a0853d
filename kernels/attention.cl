// attention: o [N, E] = A . w, A [N, M] = softmax(scale q . k + bias) over keys, streamed; and its gradients.
//
//                      keys: COLUMNS at a time ->
//              [ block ][ block ][ block ] ...        a work-item owns ROWS rows and walks over the blocks:
//     ROWS  |  [   s   ]                                1. s = q . k            register tiles over D
//     rows  |                                           2. weights from s       the running maximum and sum correct o
//     of q  |  [   o  += weights . w block  ]           3. o += weights . w     register tiles over E
//
// Cosine weights, s + 1 over their sum, need no maximum. With P the weights, g the gradient of o and delta_i = g_i . o_i:
//   softmax  ds_ij = P_ij (g_i . w_j - delta_i)         P_ij = e^(s_ij - normaliser_i), normaliser the log of the sum
//   cosine   ds_ij = (g_i . w_j - delta_i) / normaliser_i                               normaliser the sum
//   grad_q = scale ds . k   in a walk over keys;   grad_k = scale ds^T . q, grad_w = P^T . g   in a walk over queries,
//   where work-items own rows of keys. Nothing is added by two work-items, so nothing depends on their order.
//
// The operand whose rows lie along a block is packed in panels of PANEL columns (pack_weights.cl).
// On tiles (matrix_units.clh) scores and outputs are always products of three, so that weights and deviations are exact;
// dot products of three are slower than fp32, and not used.
#define PANEL 64
#include "matrix_units.clh"
#include "tile.clh"
#ifndef TILE_GROUPS
#define TILE_GROUPS 8
#endif
#define ROWS (TILE_ROWS * TILE_GROUPS)
#define EXACT 3
// Channels of q and k, and of w: what the buffers of staged rows hold.
#ifndef INNER_CHANNELS
#define INNER_CHANNELS 64
#define OUTER_CHANNELS 64
#endif
#if MATRIX_UNITS > 1
// Rows first to end - 1 of x as the left operand of products.
#define STAGE_ROWS(name, x, channels, products)                                                                   \
  uint name[2 * ROWS * PAIRS_OF(channels)] ALIGNED;                                                                  \
  stage_rows(x + (size_t)first * (channels), channels, channels, end - first, name, PAIRS_OF(channels),           \
             ROWS * PAIRS_OF(channels), products);
#define MULTIPLY_ROWS(name, x, channels, packed, j, products, s)                                                  \
  if (channels >= FEWEST_CHANNELS)                                                                                             \
    multiply_rows_bf16(PASS_REGISTERS name, PAIRS_OF(channels), end - first, (IN uint*)packed, j, products, s);   \
  else                                                                                                            \
    multiply_rows(x, channels, first, end, panel_at(packed, channels, j), s);
#define ADD_PRODUCTS(products, ...) add_products_bf16(PASS_REGISTERS products, __VA_ARGS__)
#else
#define STAGE_ROWS(name, x, channels, products)
#define MULTIPLY_ROWS(name, x, channels, packed, j, products, s) \
  multiply_rows(x, channels, first, end, panel_at(packed, channels, j), s);
#define ADD_PRODUCTS(products, ...) add_products(__VA_ARGS__)
#endif
#define FOR_TILE_GROUPS for (int g = 0; g < ROWS; g += TILE_ROWS)

// Column j of a packed operand with `inner` rows.
inline IN REAL* panel_at(IN REAL* packed, int inner, int j) {
  return packed + (size_t)(j / PANEL) * PANEL * PACKED_ROWS(inner) + j % PANEL;
}

inline REALV load_columns(IN REAL* row, int v, int left) {
  return left >= COLUMNS ? VLOAD(v, row) : load_partial(row, v, left);
}

// s[r][c] = rows first + r of x [., inner] times the columns of a panel; rows from `end` on are not used.
inline void multiply_rows(IN REAL* x, int inner, int first, int end, IN REAL* panel, REAL* s) {
  FOR_TILE_GROUPS {
    if (first + g >= end) return;
    IN REAL* rows[TILE_ROWS];
    REALV acc[TILE_ROWS][TILE_VECTORS];
    FOR_TILE_ROWS {
      rows[r] = x + (size_t)min(first + g + r, end - 1) * inner;
      FOR_TILE_VECTORS acc[r][v] = (REALV)(0);
    }
    for (int k = 0; k < inner; ++k) {
      REALV b[TILE_VECTORS];
      FOR_TILE_VECTORS b[v] = VLOAD(v, panel + (size_t)k * PANEL);
      FOR_TILE_ROWS {
        const REAL a = rows[r][k];
        FOR_TILE_VECTORS acc[r][v] += a * b[v];
      }
    }
    FOR_TILE_ROWS FOR_TILE_VECTORS VSTORE(acc[r][v], v, s + (g + r) * COLUMNS);
  }
}

// y[first + r] = factor[r] * y[first + r] + sum over k < live of s[r][k] * row (block + k) of the packed operand.
inline void add_products(const REAL* s, const REAL* factor, int live, IN REAL* packed, int packed_rows, int block,
                         GLOBAL REAL* y, int columns, int first, int end) {
  for (int j = 0; j < columns; j += COLUMNS) {
    IN REAL* panel = panel_at(packed, packed_rows, j) + (size_t)block * PANEL;
    const int left = columns - j;
    FOR_TILE_GROUPS {
      if (first + g >= end) break;
      REALV acc[TILE_ROWS][TILE_VECTORS];
      FOR_TILE_ROWS {
        const size_t row = min(first + g + r, end - 1);
        FOR_TILE_VECTORS acc[r][v] = factor[g + r] * load_columns(y + row * columns + j, v, left);
      }
      for (int k = 0; k < live; ++k) {
        REALV b[TILE_VECTORS];
        FOR_TILE_VECTORS b[v] = VLOAD(v, panel + (size_t)k * PANEL);
        FOR_TILE_ROWS {
          const REAL a = s[(g + r) * COLUMNS + k];
          FOR_TILE_VECTORS acc[r][v] += a * b[v];
        }
      }
      FOR_TILE_ROWS if (first + g + r < end) store_columns(acc[r], y + (size_t)(first + g + r) * columns + j, left);
    }
  }
}

#if MATRIX_UNITS > 1
// s = staged rows times the columns j, j + 1, .. of a packed operand.
INLINE void multiply_rows_bf16(REGISTERS const uint* staged, int pairs, int live, IN uint* packed, int j, int products,
                               float* s) {
  const Operand w = OPERAND(packed + (size_t)j * 2 * pairs, 4 * PANEL, 4 * pairs * PANEL, 0, 0);
  for (int block = 0; block < live; block += BLOCK_ROWS)
    product(PASS_REGISTERS OPERAND(staged + block * pairs, 4 * pairs, 4 * ROWS * pairs, 0, 0), 64 * pairs, w, PANEL, pairs,
            1, 1, products, s + block * PANEL, PANEL, 0);
}

// What add_products does. Few rows are packed as for fp32.
INLINE void add_products_bf16(REGISTERS int products, const float* s, const float* factor, int live, IN float* packed, int packed_rows,
                              int block, GLOBAL float* y, int columns, int first, int end) {
  if (packed_rows < FEWEST_CHANNELS) {
    add_products(s, factor, live, packed, packed_rows, block, y, columns, first, end);
    return;
  }
  uint staged[2 * ROWS * (PANEL / 2)] ALIGNED;
  float c[BLOCK_ROWS * PANEL] ALIGNED;
  stage_buffer(s, PANEL, live, ROWS, staged, PANEL / 2, ROWS * (PANEL / 2), products);
  const int pairs = PAIRS_OF(live), all_pairs = PAIRS_OF(packed_rows);
  for (int j = 0; j < columns; j += PANEL) {
    const Operand w = OPERAND((IN uint*)packed + (size_t)j * 2 * all_pairs + block / 2 * PANEL, 4 * PANEL,
                              4 * all_pairs * PANEL, 0, 0);
    const int left = columns - j;
    for (int g = 0; g < end - first; g += BLOCK_ROWS) {
      product(PASS_REGISTERS OPERAND(staged + g * (PANEL / 2), 2 * PANEL, 2 * ROWS * PANEL, 0, 0), 32 * PANEL, w, PANEL,
              pairs, 1, 1, products, c, PANEL, 0);
      for (int r = 0; r < min(BLOCK_ROWS, end - first - g); ++r) {
        GLOBAL float* row = y + (size_t)(first + g + r) * columns + j;
        float16 acc[TILE_VECTORS];
        FOR_TILE_VECTORS acc[v] = factor[g + r] * load_columns(row, v, left) + FLOATS(c + r * PANEL + 16 * v);
        store_columns(acc, row, left);
      }
    }
  }
}
#endif

inline void zero_rows(GLOBAL REAL* y, int columns, int first, int end) {
  for (size_t i = (size_t)first * columns; i < (size_t)end * columns; ++i) y[i] = 0;
}

inline REAL largest_lane(REALV x) {
  REAL lanes[VW];
  VSTORE(x, 0, lanes);
  REAL value = lanes[0];
  for (int i = 1; i < VW; ++i) value = fmax(value, lanes[i]);
  return value;
}

inline REAL sum_of_lanes(REALV x) {
  REAL lanes[VW];
  VSTORE(x, 0, lanes);
  REAL value = 0;
  for (int i = 0; i < VW; ++i) value += lanes[i];
  return value;
}

// Turns a row of products with a block of keys into weights, those of dead keys 0. Returns the factor by which the
// weights of earlier blocks shrink.
inline REAL weigh_row(REAL* s, IN REAL* bias, int live, REAL scale, int cosine, REAL* largest, REAL* total) {
  const REAL dead = -1e30f;  // far below every score: its exponential is 0
  REALV x[TILE_VECTORS];
  FOR_TILE_VECTORS {
    x[v] = scale * VLOAD(v, s);
    if (bias) x[v] += load_columns(bias, v, live);
    if (cosine) x[v] += 1;
  }
  if (live < COLUMNS) {
    FOR_TILE_VECTORS VSTORE(x[v], v, s);
    for (int c = live; c < COLUMNS; ++c) s[c] = cosine ? 0 : dead;
    FOR_TILE_VECTORS x[v] = VLOAD(v, s);
  }
  REAL shrink = 1;
  if (!cosine) {
    REALV top = x[0];
    FOR_TILE_VECTORS top = fmax(top, x[v]);
    const REAL highest = fmax(*largest, largest_lane(top));
    shrink = exp(*largest - highest);
    *largest = highest;
    FOR_TILE_VECTORS x[v] = exp(x[v] - highest);
  }
  REALV sum = (REALV)(0);
  FOR_TILE_VECTORS {
    sum += x[v];
    VSTORE(x[v], v, s);
  }
  *total = *total * shrink + sum_of_lanes(sum);
  return shrink;
}

// keys: k^T packed; values: w packed
KERNEL void attend(IN REAL* restrict q, IN REAL* restrict keys, IN REAL* restrict values, IN REAL* restrict bias,
                   GLOBAL REAL* o, GLOBAL REAL* restrict normaliser, int n, int capacity, REAL scale, int cosine, IN int* count) {
  const int first = get_global_id(0) * ROWS, end = min(first + ROWS, n), m = live_rows(capacity, count);
  if (first >= n) return;
  REAL s[ROWS * COLUMNS] ALIGNED, largest[ROWS], total[ROWS], factor[ROWS];
  BEGIN_UNITS
  STAGE_ROWS(staged, q, INNER_CHANNELS, EXACT)
  for (int r = 0; r < ROWS; ++r) {
    largest[r] = -1e30f;
    total[r] = 0;
    factor[r] = 1;
  }
  zero_rows(o, OUTER_CHANNELS, first, end);
  for (int key = 0; key < m; key += COLUMNS) {
    const int live = min(COLUMNS, m - key);
    MULTIPLY_ROWS(staged, q, INNER_CHANNELS, keys, key, EXACT, s)
    for (int r = 0; r < end - first; ++r)
      factor[r] = weigh_row(s + r * COLUMNS, bias ? bias + key : bias, live, scale, cosine, largest + r, total + r);
    ADD_PRODUCTS(EXACT, s, factor, live, values, capacity, key, o, OUTER_CHANNELS, first, end);
  }
  END_UNITS
  for (int r = 0; r < end - first; ++r) {
    const REAL by_total = total[r] == 0 ? 0 : 1 / total[r];
    normaliser[first + r] = cosine ? total[r] : largest[r] + log(total[r]);
    GLOBAL REAL* row = o + (size_t)(first + r) * OUTER_CHANNELS;
    for (int c = 0; c < OUTER_CHANNELS; ++c) row[c] *= by_total;
  }
}

// s: products q . k -> weights P; slopes: products g . w -> ds. One row against one block.
#define WEIGHTS_AND_SLOPES(s, slopes, score_bias, normaliser, delta)                          \
  {                                                                                          \
    const REALV score = scale * VLOAD(v, s) + score_bias;                                    \
    const REALV p = cosine ? (score + 1) / (normaliser) : exp(score - (normaliser));         \
    const REALV ds = (VLOAD(v, slopes) - (delta)) * (cosine ? (REALV)(1) / (normaliser) : p); \
    VSTORE(p, v, s);                                                                         \
    VSTORE(ds, v, slopes);                                                                   \
  }

// keys, values: k^T and w^T packed; key_rows: k packed
KERNEL void attend_query_gradient(IN REAL* restrict q, IN REAL* restrict grad_o, IN REAL* restrict keys,
                                  IN REAL* restrict values, IN REAL* restrict key_rows, IN REAL* restrict bias,
                                  IN REAL* restrict normaliser, IN REAL* restrict delta, GLOBAL REAL* grad_q, int n,
                                  int capacity, REAL scale, int cosine, IN int* count) {
  const int first = get_global_id(0) * ROWS, end = min(first + ROWS, n), m = live_rows(capacity, count);
  if (first >= n) return;
  REAL s[ROWS * COLUMNS] ALIGNED, slopes[ROWS * COLUMNS] ALIGNED, factor[ROWS];
  BEGIN_UNITS
  STAGE_ROWS(staged, q, INNER_CHANNELS, EXACT)
  STAGE_ROWS(staged_grad, grad_o, OUTER_CHANNELS, PRODUCTS)
  for (int r = 0; r < ROWS; ++r) factor[r] = 1;
  zero_rows(grad_q, INNER_CHANNELS, first, end);
  for (int key = 0; key < m; key += COLUMNS) {
    const int live = min(COLUMNS, m - key);
    MULTIPLY_ROWS(staged, q, INNER_CHANNELS, keys, key, EXACT, s)
    MULTIPLY_ROWS(staged_grad, grad_o, OUTER_CHANNELS, values, key, PRODUCTS, slopes)
    for (int r = 0; r < end - first; ++r) {
      const REALV row_normaliser = (REALV)(normaliser[first + r]), row_delta = (REALV)(delta[first + r]);
      FOR_TILE_VECTORS {
        const REALV score_bias = bias ? load_columns(bias + key, v, live) : (REALV)(0);
        WEIGHTS_AND_SLOPES(s + r * COLUMNS, slopes + r * COLUMNS, score_bias, row_normaliser, row_delta)
      }
    }
    ADD_PRODUCTS(PRODUCTS, slopes, factor, live, key_rows, capacity, key, grad_q, INNER_CHANNELS, first, end);
  }
  END_UNITS
  for (size_t i = (size_t)first * INNER_CHANNELS; i < (size_t)end * INNER_CHANNELS; ++i) grad_q[i] *= scale;
}

// queries, grads: q^T and g^T packed; query_rows, grad_rows: q and g packed
KERNEL void attend_key_gradient(IN REAL* restrict k, IN REAL* restrict w, IN REAL* restrict queries,
                                IN REAL* restrict grads, IN REAL* restrict query_rows, IN REAL* restrict grad_rows,
                                IN REAL* restrict bias, IN REAL* restrict normaliser, IN REAL* restrict delta,
                                GLOBAL REAL* grad_k, GLOBAL REAL* grad_w, GLOBAL REAL* restrict grad_bias, int n,
                                int capacity, REAL scale, int cosine, IN int* count) {
  const int m = live_rows(capacity, count), first = get_global_id(0) * ROWS, end = min(first + ROWS, m);
  if (first >= m) return;
  REAL s[ROWS * COLUMNS] ALIGNED, slopes[ROWS * COLUMNS] ALIGNED, factor[ROWS], bias_slope[ROWS];
  BEGIN_UNITS
  STAGE_ROWS(staged, k, INNER_CHANNELS, EXACT)
  STAGE_ROWS(staged_values, w, OUTER_CHANNELS, PRODUCTS)
  for (int r = 0; r < ROWS; ++r) {
    factor[r] = 1;
    bias_slope[r] = 0;
  }
  zero_rows(grad_k, INNER_CHANNELS, first, end);
  zero_rows(grad_w, OUTER_CHANNELS, first, end);
  for (int query = 0; query < n; query += COLUMNS) {
    const int live = min(COLUMNS, n - query);
    MULTIPLY_ROWS(staged, k, INNER_CHANNELS, queries, query, EXACT, s)
    MULTIPLY_ROWS(staged_values, w, OUTER_CHANNELS, grads, query, PRODUCTS, slopes)
    for (int r = 0; r < end - first; ++r) {
      const REAL score_bias = bias ? bias[first + r] : 0;
      FOR_TILE_VECTORS WEIGHTS_AND_SLOPES(s + r * COLUMNS, slopes + r * COLUMNS, score_bias,
                                          load_columns(normaliser + query, v, live),
                                          load_columns(delta + query, v, live))
      for (int c = 0; c < live; ++c) bias_slope[r] += slopes[r * COLUMNS + c];
    }
    ADD_PRODUCTS(PRODUCTS, s, factor, live, grad_rows, n, query, grad_w, OUTER_CHANNELS, first, end);
    ADD_PRODUCTS(PRODUCTS, slopes, factor, live, query_rows, n, query, grad_k, INNER_CHANNELS, first, end);
  }
  END_UNITS
  for (size_t i = (size_t)first * INNER_CHANNELS; i < (size_t)end * INNER_CHANNELS; ++i) grad_k[i] *= scale;
  for (int r = 0; r < end - first; ++r) grad_bias[first + r] = bias_slope[r];
}
