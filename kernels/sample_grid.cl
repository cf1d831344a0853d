// sample_grid: trilinear samples of grid [D,H,W] (z, y, x) at points [N,3]; nodes 0 and last lie on the box' faces.
//   coordinate a -> place (a - low) * scale along its axis, clamped to the grid
#include "common.clh"

KERNEL void sample_grid(IN REAL* restrict grid, IN REAL* restrict points, GLOBAL REAL* restrict y, REAL low_x,
                        REAL low_y, REAL low_z, REAL scale_x, REAL scale_y, REAL scale_z, int depth, int height,
                        int width, int capacity, IN int* count) {
  const int i = get_global_id(0);
  if (i >= live_rows(capacity, count)) return;
  const REAL low[3] = {low_x, low_y, low_z}, scale[3] = {scale_x, scale_y, scale_z};
  const int nodes[3] = {width, height, depth}, strides[3] = {1, width, width * height};
  int at = 0, next[3];
  REAL fraction[3];
  for (int axis = 0; axis < 3; ++axis) {
    const REAL place = clamp((points[3 * i + axis] - low[axis]) * scale[axis], (REAL)0, (REAL)(nodes[axis] - 1));
    const int node = min((int)place, max(nodes[axis] - 2, 0));
    fraction[axis] = place - node;
    at += node * strides[axis];
    next[axis] = nodes[axis] > 1 ? strides[axis] : 0;
  }
  REAL planes[2];
  for (int z = 0; z < 2; ++z) {
    IN REAL* plane = grid + at + z * next[2];
    const REAL front = plane[0] + fraction[0] * (plane[next[0]] - plane[0]);
    const REAL back = plane[next[1]] + fraction[0] * (plane[next[1] + next[0]] - plane[next[1]]);
    planes[z] = front + fraction[1] * (back - front);
  }
  y[i] = planes[0] + fraction[2] * (planes[1] - planes[0]);
}
