// triplane_scatter: the planes' gradient. Nothing is added by two work-items.
//
// CPUs: private copies of the gradient, each filled by one work-item from its share of the points, in the order of blocks
// of space: then a block's texels stay in the caches.
//   triplane_blocks  keys [N]: the block that a point falls into
//   triplane_add     copies [partitions, 3 H rows of PITCH]
//   triplane_sum     gradient [3,H,W,C]: copy after copy
//
// GPUs, where private copies do not pay: points are sorted by the cell (the four texels) that they fall into.
//   triplane_cells     keys [3,N]: the cell of every point on every plane, H W for points behind the count
//   triplane_cell_sums sums [3,H W,4,C]: what a cell's points give to its four texels
//   triplane_texels    gradient [3,H,W,C]: a texel is corner 0, 1, 2, 3 of the cells at and before it
//
//       cell (y-1,x-1)  cell (y-1,x)         0 - 1
//                     \ /                    |   |  corners of a cell
//                    texel (y,x)             2 - 3
//                     / .
//       cell (y,x-1)    cell (y,x)
#include "triplane.clh"

#if !GPU_FORM
// Reals from one row of a copy to the next: three cache lines more than a row has. With rows a power of two apart, the
// texels of a column would share one set of a cache.
#ifndef ROW_PADDING
#define ROW_PADDING 48
#endif
#define PITCH(width) ((width) * CHANNELS + ROW_PADDING)
#define AHEAD 8  // points whose texels are fetched before they are added
#ifndef BLOCKS_ACROSS
#define BLOCKS_ACROSS 16
#endif

INLINE int spread_bits(int x) { return (x & 1) | (x & 2) << 2 | (x & 4) << 4 | (x & 8) << 6; }
INLINE int block_along(REAL coordinate) {
  return (int)clamp((coordinate + 1) * (BLOCKS_ACROSS / 2), (REAL)0, (REAL)(BLOCKS_ACROSS - 1));
}

// Blocks count along a curve on which neighbours follow each other (Morton's). A stable sort leaves points behind the
// count behind all others.
KERNEL void triplane_blocks(IN REAL* restrict points, GLOBAL int* restrict keys, int capacity, IN int* count) {
  const int i = get_global_id(0);
  if (i >= capacity) return;
  IN REAL* point = points + (size_t)i * 3;
  keys[i] = i < live_rows(capacity, count) ? spread_bits(block_along(point[0])) | spread_bits(block_along(point[1])) << 1 |
                                                 spread_bits(block_along(point[2])) << 2
                                           : BLOCKS_ACROSS * BLOCKS_ACROSS * BLOCKS_ACROSS - 1;
}

// Where a point reads and adds on one plane, and how much of it at each of the four texels.
typedef struct {
  int from, to;
  REAL weight[4];
} Corner;

INLINE void fetch_texels(IN REAL* texel, int right, int down) {
  for (int c = 0; c < CHANNELS; c += 16) {
    __builtin_prefetch(texel + c);
    __builtin_prefetch(texel + right + c);
    __builtin_prefetch(texel + down + c);
    __builtin_prefetch(texel + right + down + c);
  }
}

KERNEL void triplane_add(IN REAL* restrict planes, IN REAL* restrict points, IN REAL* restrict grad_y,
                         IN int* restrict order, GLOBAL REAL* restrict copies, int capacity, int height, int width,
                         int partitions, IN int* count) {
  const int partition = get_global_id(0);
  if (partition >= partitions) return;
  const int rows = live_rows(capacity, count), share = (rows + partitions - 1) / partitions;
  const int end = min((partition + 1) * share, rows), elements = 3 * height * PITCH(width);
  GLOBAL REAL* sums = copies + (size_t)partition * elements;
  for (int e = 0; e < elements; e += LANES) STORE((LANE)(0), sums + e);
  const int right = width > 1 ? CHANNELS : 0, below = height > 1 ? width * CHANNELS : 0;
  const int below_sums = height > 1 ? PITCH(width) : 0;
  for (int first = partition * share; first < end; first += AHEAD) {
    const int here = min(AHEAD, end - first);
    Corner corners[AHEAD][3];
    for (int k = 0; k < here; ++k) {
      const size_t i = order[first + k];
      FOR_PLANES {
        const Footprint f = footprint(p, points + i * 3, height, width);
        const REAL both = f.fu * f.fv;
        corners[k][p] = (Corner){f.texel[0], f.texel[0] + f.row * ROW_PADDING,
                                 {1 - f.fu - f.fv + both, f.fu - both, f.fv - both, both}};
        fetch_texels(planes + corners[k][p].from, right, below);
        fetch_texels(sums + corners[k][p].to, right, below_sums);
      }
      for (int c = 0; c < CHANNELS; c += 16) __builtin_prefetch(grad_y + i * CHANNELS + c);
    }
    for (int k = 0; k < here; ++k) {
      const size_t i = order[first + k];
      UNROLL for (int v = 0; v < VECTORS; ++v) {
        LANE sample[3];
        FOR_PLANES {
          const Corner corner = corners[k][p];
          IN REAL* texel = planes + corner.from + v * LANES;
          sample[p] = LOAD(texel) * corner.weight[0] + LOAD(texel + right) * corner.weight[1] +
                      LOAD(texel + below) * corner.weight[2] + LOAD(texel + right + below) * corner.weight[3];
        }
        const LANE grad = LOAD(grad_y + i * CHANNELS + v * LANES);
        FOR_PLANES {
          const Corner corner = corners[k][p];
          const LANE part = grad * others(sample, p);
          GLOBAL REAL* upper = sums + corner.to + v * LANES;
          GLOBAL REAL* lower = upper + below_sums;
          STORE(LOAD(upper) + part * corner.weight[0], upper);
          STORE(LOAD(upper + right) + part * corner.weight[1], upper + right);
          STORE(LOAD(lower) + part * corner.weight[2], lower);
          STORE(LOAD(lower + right) + part * corner.weight[3], lower + right);
        }
      }
    }
  }
}

// One work-item per line of a plane.
KERNEL void triplane_sum(IN REAL* restrict copies, GLOBAL REAL* restrict gradient, int lines, int width,
                         int partitions) {
  const int line = get_global_id(0);
  if (line >= lines) return;
  for (int e = 0; e < width * CHANNELS; e += LANES) {
    LANE sum = (LANE)(0);
    for (int p = 0; p < partitions; ++p) sum += LOAD(copies + ((size_t)p * lines + line) * PITCH(width) + e);
    STORE(sum, gradient + (size_t)line * width * CHANNELS + e);
  }
}

#else
KERNEL void triplane_cells(IN REAL* restrict points, GLOBAL int* restrict keys, int capacity, int height, int width,
                           IN int* count) {
  const int i = get_global_id(0);
  if (i >= capacity) return;
  const int alive = i < live_rows(capacity, count);
  FOR_PLANES {
    int cell = height * width;
    if (alive) cell = footprint(p, points + (size_t)i * 3, height, width).texel[0] / CHANNELS - p * height * width;
    keys[(size_t)p * capacity + i] = cell;
  }
}

KERNEL void triplane_cell_sums(IN REAL* restrict planes, IN REAL* restrict points, IN REAL* restrict grad_y,
                               IN int* restrict keys, IN int* restrict order, GLOBAL REAL* restrict sums, int capacity,
                               int height, int width) {
  const int v = get_global_id(0), cell = get_global_id(1), plane = get_global_id(2);
  if (v >= VECTORS || cell >= height * width) return;
  keys += (size_t)plane * capacity;
  order += (size_t)plane * capacity;
  int low = 0, high = capacity;
  while (low < high) {
    const int middle = (low + high) / 2;
    if (keys[middle] < cell)
      low = middle + 1;
    else
      high = middle;
  }
  LANE sum[4] = {(LANE)(0), (LANE)(0), (LANE)(0), (LANE)(0)};
  for (; low < capacity && keys[low] == cell; ++low) {
    IN REAL* point = points + (size_t)order[low] * 3;
    LANE weight = LOAD(grad_y + (size_t)order[low] * CHANNELS + v * LANES);
#if COMBINE == PRODUCT
    FOR_PLANES if (p != plane) {
      const Footprint f = footprint(p, point, height, width);
      weight *= bilinear(planes + v * LANES, &f);
    }
#endif
    const Footprint f = footprint(plane, point, height, width);
    const LANE right = weight * f.fu, left = weight - right;
    sum[0] += left * (1 - f.fv);
    sum[1] += right * (1 - f.fv);
    sum[2] += left * f.fv;
    sum[3] += right * f.fv;
  }
  GLOBAL REAL* target = sums + ((size_t)plane * height * width + cell) * 4 * CHANNELS + v * LANES;
  UNROLL for (int t = 0; t < 4; ++t) STORE(sum[t], target + t * CHANNELS);
}

KERNEL void triplane_texels(IN REAL* restrict sums, GLOBAL REAL* restrict gradient, int height, int width) {
  const int v = get_global_id(0), column = get_global_id(1), line = get_global_id(2);  // line: plane and row
  if (v >= VECTORS || column >= width) return;
  const size_t texel = (size_t)line * width + column;
  IN REAL* corners = sums + texel * 4 * CHANNELS + v * LANES;
  const int above = line % height > 0, before = column > 0;
  LANE sum = LOAD(corners);
  if (before) sum += LOAD(corners - 3 * CHANNELS);
  if (above) sum += LOAD(corners - (size_t)width * 4 * CHANNELS + 2 * CHANNELS);
  if (above && before) sum += LOAD(corners - (size_t)width * 4 * CHANNELS - CHANNELS);
  STORE(sum, gradient + texel * CHANNELS + v * LANES);
}
#endif
