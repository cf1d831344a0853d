// triplane_scatter: the planes' gradient for GPUs, where private copies do not pay. Points are sorted by the cell (the
// four texels) that they fall into; then nothing is added by two work-items.
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
