// inverse_warp: from the observation to canonical space, by the inverse of the blended transforms of a triangle's corners.
//
//   [A | t] = sum_k barycentric[k] * T[corner k],   M = A^-1
//   canonical = M (x - t)        direction~ = M d / |M d|
//
// Gradients, with y = canonical, u = M d and g the gradients of y and u:
//   grad_x = M^T g_y    grad_d = M^T g_u    grad_[A | t] = -(M^T g_y) [y; 1]^T - (M^T g_u) [u; 0]^T
// grad_T is summed per chunk of rows into a copy of its own, [chunks, V, 12]; a work-item owns ENTRIES of the 12 numbers.
#include "affine.clh"

#ifndef ENTRIES
#define ENTRIES 12
#endif
#ifndef HAS_DIRECTIONS
#define HAS_DIRECTIONS 1
#endif

typedef struct {
  Affine inverse;  // M, t
  Vector y, u;
  REAL length;  // of u
  bool exists;
} Warped;

inline Warped warp(int i, IN REAL* points, IN REAL* directions, IN int* faces, IN REAL* barycentric, IN int* triangles,
                   IN REAL* transforms) {
  Warped warped;
  warped.exists = faces[i] >= 0;
  if (!warped.exists) return warped;
  warped.inverse = blend_corners(transforms, triangles + 3 * faces[i], barycentric[3 * i], barycentric[3 * i + 1],
                                 barycentric[3 * i + 2]);
  warped.exists = invert(&warped.inverse);
  if (!warped.exists) return warped;
  warped.y = rotate(&warped.inverse, load3(points, i) - warped.inverse.shift);
#if HAS_DIRECTIONS
  warped.u = rotate(&warped.inverse, load3(directions, i));
  warped.length = max(sqrt(dot(warped.u, warped.u)), TINY);
#endif
  return warped;
}

inline void store3(Vector value, int i, GLOBAL REAL* x) {
  x[3 * i] = value.x;
  x[3 * i + 1] = value.y;
  x[3 * i + 2] = value.z;
}

KERNEL void inverse_warp(IN REAL* restrict points, IN REAL* restrict directions, IN int* restrict faces,
                         IN REAL* restrict barycentric, IN int* restrict triangles, IN REAL* restrict transforms,
                         GLOBAL REAL* restrict canonical, GLOBAL REAL* restrict inside,
                         GLOBAL REAL* restrict canonical_directions, REAL nowhere, int capacity, IN int* count) {
  const int i = get_global_id(0);
  if (i >= live_rows(capacity, count)) return;
  const Warped warped = warp(i, points, directions, faces, barycentric, triangles, transforms);
  store3(warped.exists ? warped.y : (Vector)(nowhere), i, canonical);
  inside[i] = warped.exists ? 1 : 0;
#if HAS_DIRECTIONS
  store3(warped.exists ? warped.u / warped.length : (Vector)(0), i, canonical_directions);
#endif
}

// M^T g_y and M^T g_u: the gradients of point and direction.
inline Vector point_gradient(const Warped* warped, IN REAL* grad_canonical, int i) {
  return rotate_transposed(&warped->inverse, load3(grad_canonical, i));
}
inline Vector direction_gradient(const Warped* warped, IN REAL* grad_directions, int i) {
  const Vector unit = warped->u / warped->length, g = load3(grad_directions, i);
  return rotate_transposed(&warped->inverse, (g - unit * dot(unit, g)) / warped->length);
}

KERNEL void inverse_warp_gradient(IN REAL* restrict points, IN REAL* restrict directions, IN int* restrict faces,
                                  IN REAL* restrict barycentric, IN int* restrict triangles,
                                  IN REAL* restrict transforms, IN REAL* restrict grad_canonical,
                                  IN REAL* restrict grad_canonical_directions, GLOBAL REAL* restrict grad_points,
                                  GLOBAL REAL* restrict grad_directions, int capacity, IN int* count) {
  const int i = get_global_id(0);
  if (i >= live_rows(capacity, count)) return;
  const Warped warped = warp(i, points, directions, faces, barycentric, triangles, transforms);
  store3(warped.exists ? point_gradient(&warped, grad_canonical, i) : (Vector)(0), i, grad_points);
#if HAS_DIRECTIONS
  store3(warped.exists ? direction_gradient(&warped, grad_canonical_directions, i) : (Vector)(0), i, grad_directions);
#endif
}

KERNEL void warp_transform_partials(IN REAL* restrict points, IN REAL* restrict directions, IN int* restrict faces,
                                    IN REAL* restrict barycentric, IN int* restrict triangles,
                                    IN REAL* restrict transforms, IN REAL* restrict grad_canonical,
                                    IN REAL* restrict grad_canonical_directions, GLOBAL REAL* restrict partial,
                                    int vertices, int chunk_rows, int capacity, IN int* count) {
  const int chunk = get_global_id(0), first_entry = get_global_id(1) * ENTRIES;
  const int first = chunk * chunk_rows, end = min(first + chunk_rows, live_rows(capacity, count));
  if (first >= capacity || first_entry >= 12) return;
  GLOBAL REAL* out = partial + (size_t)chunk * vertices * 12 + first_entry;
  for (int v = 0; v < vertices; ++v)
    for (int e = 0; e < ENTRIES; ++e) out[12 * v + e] = 0;
  for (int i = first; i < end; ++i) {
    const Warped warped = warp(i, points, directions, faces, barycentric, triangles, transforms);
    if (!warped.exists) continue;
    const Vector g = point_gradient(&warped, grad_canonical, i);
    const REAL from_point[3] = {g.x, g.y, g.z}, point[4] = {warped.y.x, warped.y.y, warped.y.z, 1};
#if HAS_DIRECTIONS
    const Vector h = direction_gradient(&warped, grad_canonical_directions, i);
    const REAL from_direction[3] = {h.x, h.y, h.z}, direction[4] = {warped.u.x, warped.u.y, warped.u.z, 0};
#endif
    REAL gradient[ENTRIES];
    for (int e = 0; e < ENTRIES; ++e) {
      const int row = (first_entry + e) / 4, column = (first_entry + e) % 4;
      gradient[e] = -from_point[row] * point[column];
#if HAS_DIRECTIONS
      gradient[e] -= from_direction[row] * direction[column];
#endif
    }
    for (int k = 0; k < 3; ++k) {
      const REAL weight = barycentric[3 * i + k];
      GLOBAL REAL* corner = out + 12 * triangles[3 * faces[i] + k];
      for (int e = 0; e < ENTRIES; ++e) corner[e] += weight * gradient[e];
    }
  }
}
