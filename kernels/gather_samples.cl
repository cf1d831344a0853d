// gather_samples: the records of some rays as rows of tensors, and their places in dense [B, S] tensors.
//   count_samples   counts [B] = min(S, records of rays[b])
//   (scan)          starts [B + 1]
//   gather_samples  one work-item per RAYS rays copies its rows and writes its row of depths, deltas and rows
#include "sample_record.clh"

#ifndef RAYS
#define RAYS 16
#endif
#ifndef HAS_ROOTS
#define HAS_ROOTS 1
#endif

KERNEL void count_samples(IN int* restrict rays, IN int* restrict offsets, GLOBAL int* restrict counts, int ray_count,
                          int samples_per_ray) {
  const int b = get_global_id(0);
  if (b < ray_count) counts[b] = min(samples_per_ray, offsets[rays[b] + 1] - offsets[rays[b]]);
}

inline void put3(Vector value, int i, GLOBAL REAL* x) {
  x[3 * i] = value.x;
  x[3 * i + 1] = value.y;
  x[3 * i + 2] = value.z;
}

KERNEL void gather_samples(IN int* restrict records, IN int* restrict offsets, IN int* restrict frames,
                           IN REAL* restrict roots, IN int* restrict rays, IN REAL* restrict jitter,
                           IN int* restrict starts, GLOBAL REAL* restrict points, GLOBAL REAL* restrict directions,
                           GLOBAL REAL* restrict normals, GLOBAL REAL* restrict root,
                           GLOBAL REAL* restrict distance, GLOBAL int* restrict face,
                           GLOBAL REAL* restrict barycentric, GLOBAL int* restrict frame, GLOBAL int* restrict ids,
                           GLOBAL REAL* restrict depths, GLOBAL REAL* restrict deltas, GLOBAL int* restrict rows,
                           REAL step, REAL no_depth, int ray_count, int samples_per_ray) {
  const int begin = get_global_id(0) * RAYS;
  for (int b = begin; b < min(begin + RAYS, ray_count); ++b) {
    const int ray = rays[b], start = starts[b], count = starts[b + 1] - start;
    const REAL shift = jitter ? (jitter[b] - (REAL)0.5) * step : 0;
    for (int s = 0; s < count; ++s) {
      IN int* record = records + (size_t)(offsets[ray] + s) * RECORD_WORDS;
      const int i = start + s;
      const REAL depth = (record[7] + (REAL)0.5) * step + shift;
      const Vector towards = unpack_direction(record[3]);
      const Vector point = (Vector)(bits_float(record[0]), bits_float(record[1]), bits_float(record[2]), 0);
      put3(point + shift * towards, i, points);
      put3(towards, i, directions);
      put3(unpack_direction(record[8]), i, normals);
#if HAS_ROOTS
      for (int axis = 0; axis < 3; ++axis) root[3 * i + axis] = roots[6 * ray + axis] + depth * roots[6 * ray + 3 + axis];
#endif
      const REAL second = first_of(record[5]), third = second_of(record[5]);
      put3((Vector)(1 - second - third, second, third, 0), i, barycentric);
      distance[i] = bits_float(record[6]);
      face[i] = record[4];
      frame[i] = frames ? frames[ray] : 0;
      ids[i] = b * samples_per_ray + s;
      depths[b * samples_per_ray + s] = depth;
      deltas[b * samples_per_ray + s] = step;
      rows[b * samples_per_ray + s] = i;
    }
    for (int s = count; s < samples_per_ray; ++s) {
      depths[b * samples_per_ray + s] = no_depth;
      deltas[b * samples_per_ray + s] = 0;
      rows[b * samples_per_ray + s] = -1;
    }
  }
}
