// mlp: layers y = relu(x . W + b) in one kernel per direction; the last one ends in OUTPUT_RELU.
//
//   A work-item (GPU form: work-group) takes ROWS rows through all layers, whose outputs stay in its buffers:
//
//     x [ROWS, K] -> . W0 -> relu -> . W1 -> relu -> . W2 -> y            weights packed in panels (pack_weights.cl)
//
//   The gradient walks back over ROWS rows after rows of a chunk. d, the gradient behind a layer's bias, gives that
//   layer's partial sums x^T d and the sum of d, and the gradient before it, d . W^T, where the layer's input is positive.
//
// LAYERS lists LAYER(index, inputs, outputs, panel of the packed weights); REVERSED lists the same from the last one.
// The packed weights of the gradient are transposed.
#include "matrix_units.clh"
#ifndef LAYERS
#define LAYERS LAYER(0, 48, 128, 64) LAYER(1, 128, 32, 32)
#define REVERSED LAYER(1, 128, 32, 64) LAYER(0, 48, 128, 48)
#define LAST 1
#define FIRST_WIDTH 48
#define LAST_WIDTH 32
#endif
#ifndef ROWS
#define ROWS 24
#endif
#ifndef WIDEST
#define WIDEST 128
#endif
#ifndef OUTPUT_RELU
#define OUTPUT_RELU 0
#endif
#ifndef SAMPLE_GRADIENT
#define SAMPLE_GRADIENT 1
#endif
#ifndef LAYER_GRADIENT
#define LAYER_GRADIENT 1
#endif
// Columns of a row in a buffer: whole panels, whose width is that of panel_width() on the host.
#define BLOCKS(n) (((n) + 15) / 16)
#define PADDED(n) (BLOCKS(n) > 4 && BLOCKS(n) % 4 && BLOCKS(n) % 3 ? ((n) + 63) / 64 * 64 : BLOCKS(n) * 16)

#if GPU_FORM
#define BUFFER __local
#define BLOCK get_group_id(0)
#define EACH(i, count) for (int i = get_local_id(0); i < (count); i += get_local_size(0))
#define EACH_ELEMENT(row, c, rows, width)                                                                     \
  for (int i = get_local_id(0), row, c; row = i / (width), c = i % (width), i < (rows) * (width); i += get_local_size(0))
#define SYNC barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE)
#else
#define BUFFER
#define BLOCK get_global_id(0)
#define EACH(i, count) for (int i = 0; i < (count); ++i)
#define EACH_ELEMENT(row, c, rows, width) EACH(row, rows) EACH(c, width)
#define SYNC
#endif

// Rows of a tensor into a buffer and back; rows and columns that do not exist are zeros.
INLINE void load_rows(IN REAL* from, int width, int live, BUFFER REAL* to, int stride) {
  EACH_ELEMENT(row, c, ROWS, stride)
  to[row * stride + c] = row < live && c < width ? from[(size_t)row * width + c] : 0;
}
INLINE void store_rows(const BUFFER REAL* from, int stride, int live, GLOBAL REAL* to, int width) {
  EACH_ELEMENT(row, c, live, width) to[(size_t)row * width + c] = from[row * stride + c];
}

// Keeps what stands where the layer's output y, of which the rows exist, is positive.
INLINE void mask_rows(BUFFER REAL* d, int stride, IN REAL* y, int width, int live) {
  EACH_ELEMENT(row, c, live, width)
  d[row * stride + c] = y[(size_t)row * width + c] > 0 ? d[row * stride + c] : 0;
}

#if GPU_FORM

// y [ROWS, PADDED(outputs)] = f(x [ROWS, inputs] . W + b)
INLINE void multiply(const BUFFER REAL* x, int stride, int inputs, IN REAL* packed, int panel, IN REAL* bias,
                     int outputs, int relu, BUFFER REAL* y) {
  EACH(i, ROWS * PADDED(outputs)) {
    const int row = i / PADDED(outputs), c = i % PADDED(outputs);
    IN REAL* w = packed + (size_t)(c / panel) * panel * PACKED_ROWS(inputs) + c % panel;
    REAL sum = bias && c < outputs ? bias[c] : 0;
    for (int k = 0; k < inputs; ++k) sum += x[row * stride + k] * w[(size_t)k * panel];
    y[i] = relu ? fmax(sum, (REAL)0) : sum;
  }
}

// weights [inputs, outputs] += x^T d and biases += the sum of d
INLINE void add_products(const BUFFER REAL* x, int stride, int inputs, const BUFFER REAL* d, int outputs,
                         GLOBAL REAL* weights, GLOBAL REAL* biases) {
  EACH(i, (inputs + 1) * outputs) {
    const int k = i / outputs, c = i % outputs;
    GLOBAL REAL* target = k < inputs ? weights + i : biases + c;
    REAL sum = *target;
    for (int row = 0; row < ROWS; ++row)
      sum += (k < inputs ? x[row * stride + k] : 1) * d[row * PADDED(outputs) + c];
    *target = sum;
  }
}

#else

// Vector v of a row of a tensor, of whose columns `left` are left.
INLINE REALV load_columns(const GLOBAL REAL* row, int v, int left) {
  if ((v + 1) * VW <= left) return VLOAD(v, row);
  REAL values[VW];
  for (int i = 0; i < VW; ++i) values[i] = v * VW + i < left ? row[v * VW + i] : 0;
  return VLOAD(0, values);
}
INLINE void store_columns(REALV x, GLOBAL REAL* row, int v, int left) {
  if ((v + 1) * VW <= left) {
    VSTORE(x, v, row);
  } else {
    REAL values[VW];
    VSTORE(x, 0, values);
    for (int i = v * VW; i < left; ++i) row[i] = values[i - v * VW];
  }
}

// Register tiles of R rows and V vectors, which divide ROWS and panels of V vectors.
#define DEFINE_TILES(R, V)                                                                                         \
  INLINE void multiply_##V(const REAL* x, int stride, int inputs, IN REAL* panel, IN REAL* bias, int left,         \
                           int relu, REAL* y, int y_stride) {                                                      \
    for (int first = 0; first < ROWS; first += R) {                                                                \
      REALV acc[R][V];                                                                                             \
      UNROLL for (int v = 0; v < V; ++v) {                                                                         \
        const REALV b = bias ? load_columns(bias, v, left) : (REALV)(0);                                           \
        UNROLL for (int r = 0; r < R; ++r) acc[r][v] = b;                                                          \
      }                                                                                                            \
      const REAL* rows = x + first * stride;                                                                       \
      for (int k = 0; k < inputs; ++k) {                                                                           \
        REALV b[V];                                                                                                \
        UNROLL for (int v = 0; v < V; ++v) b[v] = VLOAD(v, panel + (size_t)k * V * VW);                            \
        UNROLL for (int r = 0; r < R; ++r) {                                                                       \
          const REAL s = rows[r * stride + k];                                                                     \
          UNROLL for (int v = 0; v < V; ++v) acc[r][v] += s * b[v];                                                \
        }                                                                                                          \
      }                                                                                                            \
      UNROLL for (int r = 0; r < R; ++r) UNROLL for (int v = 0; v < V; ++v)                                        \
          AT(y + (first + r) * y_stride, v) = relu ? fmax(acc[r][v], (REALV)(0)) : acc[r][v];                      \
    }                                                                                                              \
  }                                                                                                                \
  INLINE void add_products_##V(const REAL* x, int stride, int inputs, const REAL* d, int d_stride,                 \
                               GLOBAL REAL* weights, int outputs, int left) {                                      \
    for (int first = 0; first < inputs; first += R) {                                                              \
      REALV acc[R][V];                                                                                             \
      int column[R];                                                                                               \
      UNROLL for (int r = 0; r < R; ++r) {                                                                         \
        column[r] = min(first + r, inputs - 1);                                                                    \
        UNROLL for (int v = 0; v < V; ++v) acc[r][v] = load_columns(weights + (size_t)column[r] * outputs, v, left); \
      }                                                                                                            \
      for (int row = 0; row < ROWS; ++row) {                                                                       \
        REALV b[V];                                                                                                \
        UNROLL for (int v = 0; v < V; ++v) b[v] = AT(d + row * d_stride, v);                                       \
        UNROLL for (int r = 0; r < R; ++r) {                                                                       \
          const REAL s = x[row * stride + column[r]];                                                              \
          UNROLL for (int v = 0; v < V; ++v) acc[r][v] += s * b[v];                                                \
        }                                                                                                          \
      }                                                                                                            \
      UNROLL for (int r = 0; r < R; ++r) if (first + r < inputs)                                                   \
          UNROLL for (int v = 0; v < V; ++v) store_columns(acc[r][v], weights + (size_t)column[r] * outputs, v, left); \
    }                                                                                                              \
  }
DEFINE_TILES(12, 1)
DEFINE_TILES(12, 2)
DEFINE_TILES(8, 3)
DEFINE_TILES(6, 4)
#define BY_PANEL(panel, function, ...)                                                                       \
  (panel) == VW ? function##_1(__VA_ARGS__) : (panel) == 2 * VW ? function##_2(__VA_ARGS__)                  \
                                            : (panel) == 3 * VW ? function##_3(__VA_ARGS__) : function##_4(__VA_ARGS__)

#if MATRIX_UNITS
#define WIDEST_PAIRS PAIRS_OF(WIDEST)

INLINE void multiply_bf16(REGISTERS const float* x, int stride, int inputs, IN uint* packed, int panel, IN float* bias,
                          int outputs, int relu, float* y) {
  const int pairs = PAIRS_OF(inputs), y_stride = PADDED(outputs);
  uint staged[2 * ROWS * WIDEST_PAIRS] ALIGNED;
  stage_buffer(x, stride, inputs, ROWS, staged, pairs, ROWS * pairs, PRODUCTS);
  for (int j = 0; j < outputs; j += panel)
    for (int block = 0; block < ROWS; block += BLOCK_ROWS)
      product(PASS_REGISTERS OPERAND(staged + block * pairs, 4 * pairs, 4 * ROWS * pairs, 0, 0), 64 * pairs,
              OPERAND(packed + j * 2 * pairs, 4 * panel, 4 * pairs * panel, 0, 0), panel, pairs, 1, 1, PRODUCTS,
              y + block * y_stride + j, y_stride, 0);
  for (int v = 0; v < y_stride / 16; ++v) {
    const float16 b = bias ? load_columns(bias, v, outputs) : (float16)(0);
    for (int row = 0; row < ROWS; ++row) {
      const float16 sum = AT(y + row * y_stride, v) + b;
      AT(y + row * y_stride, v) = relu ? fmax(sum, (float16)(0)) : sum;
    }
  }
}

INLINE void add_products_bf16(REGISTERS const float* x, int stride, int inputs, const float* d, int outputs,
                              GLOBAL float* weights) {
  const int d_stride = PADDED(outputs), panel = d_stride % 64 == 0 ? 64 : d_stride % 48 == 0 ? 48 : d_stride;
  uint left[2 * (WIDEST + 16) * (ROWS / 2)] ALIGNED, right[2 * WIDEST * (ROWS / 2)] ALIGNED;
  const int left_rest = (WIDEST + 16) * (ROWS / 2), right_rest = WIDEST * (ROWS / 2);
  for (int row = 0; row < ROWS; row += 32)
    for (int i = 0; i < inputs; i += 16) {
      float16 rows[32];
      for (int r = 0; r < 32; ++r) rows[r] = AT(x + (row + r) * stride + i, 0);
      stage_transposed(rows, left + i * (ROWS / 2) + row / 2, ROWS / 2, left_rest, PRODUCTS);
    }
  for (int row = 0; row < ROWS; row += 2)
    for (int j = 0; j < d_stride; j += 16) {
      uint16 hi, lo;
      split_pairs(AT(d + row * d_stride + j, 0), AT(d + (row + 1) * d_stride + j, 0), &hi, &lo);
      *(uint16*)(right + row / 2 * d_stride + j) = hi;
      *(uint16*)(right + right_rest + row / 2 * d_stride + j) = lo;
    }
  for (int i = 0; i < inputs; i += BLOCK_ROWS)
    for (int j = 0; j < outputs; j += panel)
      product_into(PASS_REGISTERS OPERAND(left + i * (ROWS / 2), 2 * ROWS, 4 * left_rest, 0, 0), 32 * ROWS,
                   OPERAND(right + j, 4 * d_stride, 4 * right_rest, 0, 0), panel, ROWS / 2, 1, 1, PRODUCTS,
                   weights + (size_t)i * outputs + j, outputs, inputs - i, outputs - j, 1);
}
#endif

INLINE void multiply(REGISTERS const REAL* x, int stride, int inputs, IN REAL* packed, int panel, IN REAL* bias,
                     int outputs, int relu, REAL* y) {
#if MATRIX_UNITS
  if (inputs >= FEWEST_CHANNELS) {
    multiply_bf16(PASS_REGISTERS x, stride, inputs, (IN uint*)packed, panel, bias, outputs, relu, y);
    return;
  }
#endif
  for (int j = 0; j < outputs; j += panel)
    BY_PANEL(panel, multiply, x, stride, inputs, packed + (size_t)j * PACKED_ROWS(inputs), bias ? bias + j : bias, outputs - j, relu,
             y + j, PADDED(outputs));
}

INLINE void add_products(REGISTERS const REAL* x, int stride, int inputs, const REAL* d, int outputs,
                         GLOBAL REAL* weights, GLOBAL REAL* biases) {
  const int on_units = MATRIX_UNITS && min(inputs, outputs) >= FEWEST_CHANNELS;
#if MATRIX_UNITS
  if (on_units) add_products_bf16(PASS_REGISTERS x, stride, inputs, d, outputs, weights);
#endif
  const int count = PADDED(outputs) / VW, vectors = count % 4 == 0 ? 4 : count % 3 == 0 ? 3 : count % 2 == 0 ? 2 : 1;
  for (int j = 0; j < outputs; j += vectors * VW) {
    if (!on_units) BY_PANEL(vectors * VW, add_products, x, stride, inputs, d + j, PADDED(outputs), weights + j, outputs, outputs - j);
    for (int v = 0; v < vectors; ++v) {
      REALV sum = load_columns(biases + j, v, outputs - j);
      for (int row = 0; row < ROWS; ++row) sum += AT(d + j + row * PADDED(outputs), v);
      store_columns(sum, biases + j, v, outputs - j);
    }
  }
}
#endif

#define LAYER(l, inputs, outputs, panel) , IN REAL* restrict packed##l, IN REAL* restrict bias##l, GLOBAL REAL* restrict y##l
// y of a layer before the last one may be null: nothing reads it.
KERNEL void mlp(IN REAL* restrict x, int capacity, IN int* count LAYERS) {
#undef LAYER
  const int rows = live_rows(capacity, count), first = BLOCK * ROWS, live = min(ROWS, rows - first);
  if (live <= 0) return;
  BUFFER REAL a[ROWS * WIDEST] ALIGNED, b[ROWS * WIDEST] ALIGNED;
  BEGIN_UNITS
  load_rows(x + (size_t)first * FIRST_WIDTH, FIRST_WIDTH, live, a, PADDED(FIRST_WIDTH));
  SYNC;
#define LAYER(l, inputs, outputs, panel)                                                                            \
  {                                                                                                                 \
    BUFFER REAL* from = l % 2 ? b : a;                                                                              \
    BUFFER REAL* to = l % 2 ? a : b;                                                                                \
    multiply(PASS_REGISTERS from, PADDED(inputs), inputs, packed##l, panel, bias##l, outputs, l < LAST || OUTPUT_RELU, to);        \
    SYNC;                                                                                                           \
    if (y##l) store_rows(to, PADDED(outputs), live, y##l + (size_t)first * outputs, outputs);                       \
    SYNC;                                                                                                           \
  }
  LAYERS
#undef LAYER
  END_UNITS
}

// x of layer l is in##l, its partial sums are weights##l and biases##l, [chunks] of each.
#define LAYER(l, inputs, outputs, panel) \
  , IN REAL* restrict in##l, IN REAL* restrict packed##l, GLOBAL REAL* restrict weights##l, GLOBAL REAL* restrict biases##l
KERNEL void mlp_gradient(IN REAL* restrict y, IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x, int capacity,
                         int chunk_rows, IN int* count LAYERS) {
#undef LAYER
  const int chunk = BLOCK, begin = chunk * chunk_rows;
  const int end = min(begin + chunk_rows, live_rows(capacity, count));
  if (begin >= capacity) return;
  BUFFER REAL x[ROWS * WIDEST] ALIGNED, a[ROWS * WIDEST] ALIGNED, b[ROWS * WIDEST] ALIGNED;
#define LAYER(l, inputs, outputs, panel)                                 \
  GLOBAL REAL* w##l = weights##l + (size_t)chunk * (inputs) * (outputs); \
  GLOBAL REAL* b##l = biases##l + (size_t)chunk * (outputs);             \
  EACH(i, LAYER_GRADIENT * (inputs) * (outputs)) w##l[i] = 0;            \
  EACH(i, LAYER_GRADIENT * (outputs)) b##l[i] = 0;
  LAYERS
#undef LAYER
  BEGIN_UNITS
  for (int first = begin; first < end; first += ROWS) {
    const int live = min(ROWS, end - first);
    load_rows(grad_y + (size_t)first * LAST_WIDTH, LAST_WIDTH, live, (LAST % 2 ? b : a), PADDED(LAST_WIDTH));
    SYNC;
#if OUTPUT_RELU
    mask_rows((LAST % 2 ? b : a), PADDED(LAST_WIDTH), y + (size_t)first * LAST_WIDTH, LAST_WIDTH, live);
    SYNC;
#endif
#define LAYER(l, inputs, outputs, panel)                                                                 \
  {                                                                                                      \
    BUFFER REAL* d = l % 2 ? b : a;                                                                      \
    BUFFER REAL* before = l % 2 ? a : b;                                                                 \
    IN REAL* in = in##l + (size_t)first * (inputs);                                                      \
    if (LAYER_GRADIENT) {                                                                                \
      load_rows(in, inputs, live, x, PADDED(inputs));                                                    \
      SYNC;                                                                                              \
      add_products(PASS_REGISTERS x, PADDED(inputs), inputs, d, outputs, w##l, b##l);                                   \
    }                                                                                                    \
    SYNC;                                                                                                \
    if (l > 0 || SAMPLE_GRADIENT) multiply(PASS_REGISTERS d, PADDED(outputs), outputs, packed##l, panel, 0, inputs, 0, before); \
    SYNC;                                                                                                \
    if (l > 0) mask_rows(before, PADDED(inputs), in, inputs, live);                                      \
    SYNC;                                                                                                \
  }
    REVERSED
#undef LAYER
#if SAMPLE_GRADIENT
    store_rows(b, PADDED(FIRST_WIDTH), live, grad_x + (size_t)first * FIRST_WIDTH, FIRST_WIDTH);
    SYNC;
#endif
  }
  END_UNITS
}
