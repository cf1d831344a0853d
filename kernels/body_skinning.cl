// body_skinning: transforms are rows of 12 numbers, a row-major 3x4 matrix [A | t].
//
//   T_v = sum_k weight[v][k] * T[joint[v][k]]          rest [V,3]  T [J,12]  joint, weight [V,K]
//   posed_v = A_v rest_v + t_v                         -> posed [V,3]  blended [V,12]
//
// One work-item per vertex. The gradient of T is summed per chunk of vertices into a copy of its own,
// [chunks, J, 12], and the copies are added in order; a work-item owns ENTRIES of the 12 numbers of one chunk.
#include "common.clh"

#ifndef ENTRIES
#define ENTRIES 12
#endif

KERNEL void body_skinning(IN REAL* restrict rest, IN REAL* restrict transforms, IN int* restrict joints,
                          IN REAL* restrict weights, GLOBAL REAL* restrict posed, GLOBAL REAL* restrict blended,
                          int vertices, int influences) {
  const int v = get_global_id(0);
  if (v >= vertices) return;
  REAL t[12];
  for (int e = 0; e < 12; ++e) t[e] = 0;
  for (int k = 0; k < influences; ++k) {
    const REAL weight = weights[v * influences + k];
    IN REAL* joint = transforms + 12 * joints[v * influences + k];
    for (int e = 0; e < 12; ++e) t[e] += weight * joint[e];
  }
  const REAL x = rest[3 * v], y = rest[3 * v + 1], z = rest[3 * v + 2];
  for (int r = 0; r < 3; ++r) posed[3 * v + r] = t[4 * r] * x + t[4 * r + 1] * y + t[4 * r + 2] * z + t[4 * r + 3];
  for (int e = 0; e < 12; ++e) blended[12 * v + e] = t[e];
}

// grad_rest_v = A_v^T grad_posed_v
KERNEL void skinning_rest_gradient(IN REAL* restrict blended, IN REAL* restrict grad_posed,
                                   GLOBAL REAL* restrict grad_rest, int vertices) {
  const int v = get_global_id(0);
  if (v >= vertices) return;
  IN REAL* t = blended + 12 * v;
  IN REAL* g = grad_posed + 3 * v;
  for (int c = 0; c < 3; ++c) grad_rest[3 * v + c] = t[c] * g[0] + t[4 + c] * g[1] + t[8 + c] * g[2];
}

// partial[chunk][joint] = sum over the chunk's vertices of weight * (grad_blended + grad_posed [rest; 1]^T)
KERNEL void skinning_transform_partials(IN REAL* restrict rest, IN int* restrict joints, IN REAL* restrict weights,
                                        IN REAL* restrict grad_posed, IN REAL* restrict grad_blended,
                                        GLOBAL REAL* restrict partial, int vertices, int influences, int joint_count,
                                        int chunk_vertices) {
  const int chunk = get_global_id(0), first_entry = get_global_id(1) * ENTRIES;
  const int first = chunk * chunk_vertices, end = min(first + chunk_vertices, vertices);
  if (first >= vertices || first_entry >= 12) return;
  GLOBAL REAL* out = partial + (size_t)chunk * joint_count * 12 + first_entry;
  for (int j = 0; j < joint_count; ++j)
    for (int e = 0; e < ENTRIES; ++e) out[12 * j + e] = 0;
  for (int v = first; v < end; ++v) {
    const REAL point[4] = {rest[3 * v], rest[3 * v + 1], rest[3 * v + 2], 1};
    REAL gradient[ENTRIES];
    for (int e = 0; e < ENTRIES; ++e) {
      const int entry = first_entry + e;
      gradient[e] = grad_blended[12 * v + entry] + grad_posed[3 * v + entry / 4] * point[entry % 4];
    }
    for (int k = 0; k < influences; ++k) {
      const REAL weight = weights[v * influences + k];
      GLOBAL REAL* joint = out + 12 * joints[v * influences + k];
      for (int e = 0; e < ENTRIES; ++e) joint[e] += weight * gradient[e];
    }
  }
}

// y = a after b: [Aa Ab | Aa tb + ta]
KERNEL void compose_transforms(IN REAL* restrict a, IN REAL* restrict b, GLOBAL REAL* restrict y, int rows) {
  const int i = get_global_id(0);
  if (i >= rows) return;
  IN REAL* m = a + 12 * i;
  IN REAL* n = b + 12 * i;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      y[12 * i + 4 * r + c] =
          m[4 * r] * n[c] + m[4 * r + 1] * n[4 + c] + m[4 * r + 2] * n[8 + c] + (c == 3 ? m[4 * r + 3] : (REAL)0);
}

// grad_a = [G Ab^T + g tb^T | g], grad_b = Aa^T [G | g], for the gradient [G | g] of y.
KERNEL void compose_gradient(IN REAL* restrict a, IN REAL* restrict b, IN REAL* restrict grad_y,
                             GLOBAL REAL* restrict grad_a, GLOBAL REAL* restrict grad_b, int rows) {
  const int i = get_global_id(0);
  if (i >= rows) return;
  IN REAL* m = a + 12 * i;
  IN REAL* n = b + 12 * i;
  IN REAL* g = grad_y + 12 * i;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      grad_a[12 * i + 4 * r + c] = g[4 * r] * n[4 * c] + g[4 * r + 1] * n[4 * c + 1] + g[4 * r + 2] * n[4 * c + 2] +
                                   g[4 * r + 3] * n[4 * c + 3];
    grad_a[12 * i + 4 * r + 3] = g[4 * r + 3];
    for (int c = 0; c < 4; ++c)
      grad_b[12 * i + 4 * r + c] = m[r] * g[c] + m[4 + r] * g[4 + c] + m[8 + r] * g[8 + c];
  }
}
