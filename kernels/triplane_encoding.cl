// triplane_encoding: the positional encoding of a grid of size^3 voxels in [-1, 1]^3, averaged on the planes xy, xz, yz.
//   The average over a regular grid is separable: on the plane of axes (a, b), gamma of the pixel's own a and b, and
//   the mean of gamma over all voxels of the third axis c. The volume is never built.
//   y [3, size, size, D], D = 3 (1 + 2 L) in the order of positional_encoding; one work-item per row of a plane.
// With OCCUPIED, D + 1 + D channels: behind the full average comes the occupancy (0 or 1) and the average of gamma over
// the occupied voxels that fall on the pixel: points [P, 3] are their centres.
#include "common.clh"
#ifndef OCCUPIED
#define OCCUPIED 0
#endif

inline int first_axis(int plane) { return plane == 2 ? 1 : 0; }
inline int second_axis(int plane) { return plane == 0 ? 1 : 2; }

// The group of gamma that channel d belongs to (0 is x itself), at `value`.
inline REAL encode(REAL value, int group) {
  if (group == 0) return value;
  const REAL scaled = ldexp(value, (group - 1) / 2);
  return group % 2 ? sinpi(scaled) : cospi(scaled);
}

inline REAL centre(int i, int size) { return ((REAL)(2 * i + 1)) / size - 1; }

KERNEL void triplane_encoding(IN REAL* restrict points, GLOBAL REAL* restrict y, int size, int frequencies,
                              int point_count) {
  const int row = get_global_id(0), plane = get_global_id(1);
  if (row >= size) return;
  const int groups = 1 + 2 * frequencies, width = 3 * groups, channels = OCCUPIED ? 2 * width + 1 : width;
  const int a = first_axis(plane), b = second_axis(plane), c = 3 - a - b;
  GLOBAL REAL* out = y + (size_t)(plane * size + row) * size * channels;
  for (int group = 0; group < groups; ++group) {
    REAL mean = 0;
    for (int i = 0; i < size; ++i) mean += encode(centre(i, size), group);
    mean /= size;
    const REAL own_row = encode(centre(row, size), group);
    for (int column = 0; column < size; ++column) {
      GLOBAL REAL* pixel = out + (size_t)column * channels + 3 * group;
      pixel[a] = encode(centre(column, size), group);
      pixel[b] = own_row;
      pixel[c] = mean;
    }
  }
#if OCCUPIED
  for (int column = 0; column < size; ++column)
    for (int d = width; d < channels; ++d) out[(size_t)column * channels + d] = 0;
  for (int p = 0; p < point_count; ++p) {
    IN REAL* point = points + (size_t)p * 3;
    if (clamp((int)((point[b] + 1) / 2 * size), 0, size - 1) != row) continue;
    const int column = clamp((int)((point[a] + 1) / 2 * size), 0, size - 1);
    GLOBAL REAL* pixel = out + (size_t)column * channels + width;
    pixel[0] += 1;
    for (int group = 0; group < groups; ++group)
      for (int axis = 0; axis < 3; ++axis) pixel[1 + 3 * group + axis] += encode(point[axis], group);
  }
  for (int column = 0; column < size; ++column) {
    GLOBAL REAL* pixel = out + (size_t)column * channels + width;
    if (pixel[0] == 0) continue;
    for (int d = 1; d <= width; ++d) pixel[d] /= pixel[0];
    pixel[0] = 1;
  }
#endif
}
