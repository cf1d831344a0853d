// trace_samples: the samples of rays near a posed body, warped to the canonical pose.
//   march         one work-item per RAYS rays walks each ray through the body's boxes:
//
//        o------|k0 . . . . x x x x . . x x x .|------>     depth (k + 1/2) step
//                   skip       keep  skip
//
//                 A sample at distance d has no kept one nearer than d - threshold, so the march jumps there. Kept
//                 samples are noted as (step, triangle) in the ray's own places of `found` [R, S, 2].
//   pack_records  one work-item per RAYS rays: exact foot point, sign and warp of each kept sample -> records [.., 9]
#include "affine.clh"
#include "mesh_tree.clh"
#include "sample_record.clh"

#ifndef RAYS
#define RAYS 8
#endif
#define SLACK ((REAL)1e-5)  // metres, more than the rounding of distances

// Where the ray is inside a child box of the root, grown by `margin`: (near, far), far < near when nowhere.
inline REAL2 body_interval(IN REAL* root, Vector origin, Vector direction, REAL margin) {
  REAL near = INFINITY, far = -INFINITY;
  const REAL from[3] = {origin.x, origin.y, origin.z}, along[3] = {direction.x, direction.y, direction.z};
  for (int child = 0; child < WIDTH; ++child) {
    if (root[child] > root[3 * WIDTH + child]) continue;  // empty
    REAL enter = 0, leave = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
      const REAL low = root[axis * WIDTH + child] - margin, high = root[(3 + axis) * WIDTH + child] + margin;
      const REAL slope = 1 / (fabs(along[axis]) < TINY ? TINY : along[axis]);
      const REAL a = (low - from[axis]) * slope, b = (high - from[axis]) * slope;
      enter = max(enter, min(a, b));
      leave = min(leave, max(a, b));
    }
    if (enter > leave) continue;
    near = min(near, enter);
    far = max(far, leave);
  }
  return (REAL2)(near, far);
}

KERNEL void march(IN REAL* restrict origins, IN REAL* restrict directions, IN REAL* restrict leaves,
                  IN REAL* restrict bounds, IN int* restrict leaf_triangles, GLOBAL int* restrict found,
                  GLOBAL int* restrict counts, int leaf_count, REAL step, REAL threshold, REAL reach,
                  int samples_per_ray, int capacity, IN int* count) {
  const Tree tree = tree_over(leaf_count);
  IN REAL* root = bounds + (size_t)tree.first[tree.levels - 1] * BOUND_ROWS * WIDTH;
  const int live = live_rows(capacity, count), first = get_global_id(0) * RAYS;
  for (int ray = first; ray < min(first + RAYS, capacity); ++ray) {
    int kept = 0;
    if (ray < live) {
      const Vector origin = load3(origins, ray), direction = load3(directions, ray);
      const REAL2 interval = body_interval(root, origin, direction, threshold);
      int k = interval.x <= interval.y ? max(0, (int)ceil(interval.x / step - (REAL)0.5)) : 0;
      const int last = interval.x <= interval.y ? (int)floor(interval.y / step - (REAL)0.5) : -1;
      REAL radius = reach;
      while (k <= last && kept < samples_per_ray) {
        const Vector at = origin + (k + (REAL)0.5) * step * direction;
        REAL distance = reach;
        const int slot = closest_slot(bounds, leaves, &tree, at.x, at.y, at.z, radius, &distance);
        if (slot >= 0 && distance < threshold) {
          GLOBAL int* place = found + 2 * ((size_t)ray * samples_per_ray + kept);
          place[0] = k;
          place[1] = leaf_triangles[slot];
          ++kept;
        }
        const int skipped = max(0, (int)((distance - threshold - SLACK) / step));
        k += skipped + 1;
        radius = min(reach, distance + (skipped + 1) * step + SLACK);
      }
    }
    counts[ray] = kept;
  }
}

KERNEL void pack_records(IN REAL* restrict origins, IN REAL* restrict directions, IN REAL* restrict vertices,
                         IN REAL* restrict normals, IN int* restrict triangles, IN int* restrict neighbours,
                         IN REAL* restrict transforms, IN int* restrict found, IN int* restrict offsets,
                         GLOBAL int* restrict records, REAL step, REAL nowhere, int samples_per_ray, int rays) {
  const int first = get_global_id(0) * RAYS;
  for (int ray = first; ray < min(first + RAYS, rays); ++ray) {
    const Vector origin = load3(origins, ray), direction = load3(directions, ray);
    for (int i = offsets[ray]; i < offsets[ray + 1]; ++i) {
      IN int* place = found + 2 * ((size_t)ray * samples_per_ray + (i - offsets[ray]));
      const int k = place[0], face = place[1];
      IN int* corner = triangles + 3 * face;
      const Vector at = origin + (k + (REAL)0.5) * step * direction;
      const Foot foot = closest_on_triangle(at, load3(vertices, corner[0]), load3(vertices, corner[1]),
                                            load3(vertices, corner[2]));
      const Vector normal = pseudo_normal(foot, face, vertices, normals, triangles, neighbours);
      Affine inverse = blend_corners(transforms, corner, foot.weight[0], foot.weight[1], foot.weight[2]);
      Vector point = (Vector)(nowhere), towards = direction;
      if (invert(&inverse)) {
        point = rotate(&inverse, at - inverse.shift);
        towards = rotate(&inverse, direction);
      }
      GLOBAL int* record = records + (size_t)i * RECORD_WORDS;
      record[0] = float_bits(point.x);
      record[1] = float_bits(point.y);
      record[2] = float_bits(point.z);
      record[3] = pack_direction(towards);
      record[4] = face;
      record[5] = pack_pair(foot.weight[1], foot.weight[2]);
      record[6] = float_bits(signed_distance(at, foot.point, normal));
      record[7] = k;
      record[8] = pack_direction(foot.weight[0] * load3(normals, corner[0]) + foot.weight[1] * load3(normals, corner[1]) +
                                 foot.weight[2] * load3(normals, corner[2]));
    }
  }
}
