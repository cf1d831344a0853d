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
#define PANEL 64
#include "tile.clh"
#ifndef TILE_GROUPS
#define TILE_GROUPS 8
#endif
#define ROWS (TILE_ROWS * TILE_GROUPS)
#define FOR_TILE_GROUPS for (int g = 0; g < ROWS; g += TILE_ROWS)

// Column j of a packed operand with `inner` rows.
inline IN REAL* panel_at(IN REAL* packed, int inner, int j) {
  return packed + (size_t)(j / PANEL) * PANEL * inner + j % PANEL;
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
                   GLOBAL REAL* o, GLOBAL REAL* restrict normaliser, int n, int capacity, int inner, int columns,
                   REAL scale, int cosine, IN int* count) {
  const int first = get_global_id(0) * ROWS, end = min(first + ROWS, n), m = live_rows(capacity, count);
  if (first >= n) return;
  REAL s[ROWS * COLUMNS], largest[ROWS], total[ROWS], factor[ROWS];
  for (int r = 0; r < ROWS; ++r) {
    largest[r] = -1e30f;
    total[r] = 0;
    factor[r] = 1;
  }
  zero_rows(o, columns, first, end);
  for (int key = 0; key < m; key += COLUMNS) {
    const int live = min(COLUMNS, m - key);
    multiply_rows(q, inner, first, end, panel_at(keys, inner, key), s);
    for (int r = 0; r < end - first; ++r)
      factor[r] = weigh_row(s + r * COLUMNS, bias ? bias + key : bias, live, scale, cosine, largest + r, total + r);
    add_products(s, factor, live, values, capacity, key, o, columns, first, end);
  }
  for (int r = 0; r < end - first; ++r) {
    const REAL by_total = total[r] == 0 ? 0 : 1 / total[r];
    normaliser[first + r] = cosine ? total[r] : largest[r] + log(total[r]);
    GLOBAL REAL* row = o + (size_t)(first + r) * columns;
    for (int c = 0; c < columns; ++c) row[c] *= by_total;
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
                                  int capacity, int inner, int columns, REAL scale, int cosine, IN int* count) {
  const int first = get_global_id(0) * ROWS, end = min(first + ROWS, n), m = live_rows(capacity, count);
  if (first >= n) return;
  REAL s[ROWS * COLUMNS], slopes[ROWS * COLUMNS], factor[ROWS];
  for (int r = 0; r < ROWS; ++r) factor[r] = 1;
  zero_rows(grad_q, inner, first, end);
  for (int key = 0; key < m; key += COLUMNS) {
    const int live = min(COLUMNS, m - key);
    multiply_rows(q, inner, first, end, panel_at(keys, inner, key), s);
    multiply_rows(grad_o, columns, first, end, panel_at(values, columns, key), slopes);
    for (int r = 0; r < end - first; ++r) {
      const REALV row_normaliser = (REALV)(normaliser[first + r]), row_delta = (REALV)(delta[first + r]);
      FOR_TILE_VECTORS {
        const REALV score_bias = bias ? load_columns(bias + key, v, live) : (REALV)(0);
        WEIGHTS_AND_SLOPES(s + r * COLUMNS, slopes + r * COLUMNS, score_bias, row_normaliser, row_delta)
      }
    }
    add_products(slopes, factor, live, key_rows, capacity, key, grad_q, inner, first, end);
  }
  for (size_t i = (size_t)first * inner; i < (size_t)end * inner; ++i) grad_q[i] *= scale;
}

// queries, grads: q^T and g^T packed; query_rows, grad_rows: q and g packed
KERNEL void attend_key_gradient(IN REAL* restrict k, IN REAL* restrict w, IN REAL* restrict queries,
                                IN REAL* restrict grads, IN REAL* restrict query_rows, IN REAL* restrict grad_rows,
                                IN REAL* restrict bias, IN REAL* restrict normaliser, IN REAL* restrict delta,
                                GLOBAL REAL* grad_k, GLOBAL REAL* grad_w, GLOBAL REAL* restrict grad_bias, int n,
                                int capacity, int inner, int columns, REAL scale, int cosine, IN int* count) {
  const int m = live_rows(capacity, count), first = get_global_id(0) * ROWS, end = min(first + ROWS, m);
  if (first >= m) return;
  REAL s[ROWS * COLUMNS], slopes[ROWS * COLUMNS], factor[ROWS], bias_slope[ROWS];
  for (int r = 0; r < ROWS; ++r) {
    factor[r] = 1;
    bias_slope[r] = 0;
  }
  zero_rows(grad_k, inner, first, end);
  zero_rows(grad_w, columns, first, end);
  for (int query = 0; query < n; query += COLUMNS) {
    const int live = min(COLUMNS, n - query);
    multiply_rows(k, inner, first, end, panel_at(queries, inner, query), s);
    multiply_rows(w, columns, first, end, panel_at(grads, columns, query), slopes);
    for (int r = 0; r < end - first; ++r) {
      const REAL score_bias = bias ? bias[first + r] : 0;
      FOR_TILE_VECTORS WEIGHTS_AND_SLOPES(s + r * COLUMNS, slopes + r * COLUMNS, score_bias,
                                          load_columns(normaliser + query, v, live),
                                          load_columns(delta + query, v, live))
      for (int c = 0; c < live; ++c) bias_slope[r] += slopes[r * COLUMNS + c];
    }
    add_products(s, factor, live, grad_rows, n, query, grad_w, columns, first, end);
    add_products(slopes, factor, live, query_rows, n, query, grad_k, inner, first, end);
  }
  for (size_t i = (size_t)first * inner; i < (size_t)end * inner; ++i) grad_k[i] *= scale;
  for (int r = 0; r < end - first; ++r) grad_bias[first + r] = bias_slope[r];
}
