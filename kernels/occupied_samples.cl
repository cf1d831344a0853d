// occupied_samples: the samples of rays that may weigh something, by a grid of density bounds over [-1, 1]^3.
//   grid [D,H,W,2]: the least and the largest density of a cell (z, y, x)   points [R S,3]   deltas [R,S]
//   mark_samples    rows [R,S] = 0 where largest * delta > threshold and what lies before, at the least, lets more than
//                   `threshold` of the light pass; else -1. counts [R]
//   number_samples  rows: the marked samples, in order; ids: their inverse, -1 behind the last
// One work-item per ray.
#include "common.clh"

inline int cell_along(REAL coordinate, int cells) {
  return (int)clamp((coordinate + 1) * ((REAL)0.5 * cells), (REAL)0, (REAL)(cells - 1));
}

KERNEL void mark_samples(IN REAL* restrict grid, IN REAL* restrict points, IN REAL* restrict deltas,
                         GLOBAL int* restrict rows, GLOBAL int* restrict counts, int rays, int samples, int depth,
                         int height, int width, REAL threshold, REAL opaque) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  REAL passed = 0;  // least optical depth
  int count = 0;
  for (int i = ray * samples; i < (ray + 1) * samples; ++i) {
    IN REAL* point = points + (size_t)i * 3;
    const int z = cell_along(point[2], depth), y = cell_along(point[1], height), x = cell_along(point[0], width);
    IN REAL* bounds = grid + 2 * (((size_t)z * height + y) * width + x);
    const int occupied = bounds[1] * deltas[i] > threshold && passed < opaque;
    rows[i] = occupied - 1;
    count += occupied;
    passed += bounds[0] * deltas[i];
  }
  counts[ray] = count;
}

KERNEL void number_samples(IN int* restrict starts, IN int* restrict total, GLOBAL int* restrict rows,
                           GLOBAL int* restrict ids, int rays, int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  int row = starts[ray];
  for (int i = ray * samples; i < (ray + 1) * samples; ++i)
    if (rows[i] == 0) {
      ids[row] = i;
      rows[i] = row++;
    }
  for (int k = max(total[0], ray * samples); k < (ray + 1) * samples; ++k) ids[k] = -1;
}
