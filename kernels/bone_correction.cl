// bone_correction: e_n = sum_k w_k (r_k x (x_n - c_k) + t_k) over the joints k that hold the place (face, barycentric).
//
//   points [N,3]  face [N]  barycentric [N,3]  frame [N]  codes [frames, J, 6] = (r, t)     -> e [N,3]
//   triangles [F,3] -> vertex v -> joints [V,K], weights [V,K];  centres [J,3]
//
//        x_n . . . closest place on the mesh --- corner v0 (b0) -- K joints, weights
//                                            \-- corner v1 (b1) -- K joints, weights
//                                             \- corner v2 (b2) -- K joints, weights
//
// One work-item per point. The gradient of the codes is summed per chunk of points into a copy of its own,
// [chunks, frames * J * 6], and the copies are added in order; a work-item owns ENTRIES of the six numbers of a chunk.
#include "common.clh"

#ifndef ENTRIES
#define ENTRIES 6
#endif


// y[0..2] += weight * (a x b); scalars, since checkers of kernels do not all know vectors of three.
#define ADD_CROSS(y, weight, a, b0, b1, b2)          \
  (y)[0] += (weight) * ((a)[1] * (b2) - (a)[2] * (b1)); \
  (y)[1] += (weight) * ((a)[2] * (b0) - (a)[0] * (b2)); \
  (y)[2] += (weight) * ((a)[0] * (b1) - (a)[1] * (b0))

KERNEL void bone_correction(IN REAL* restrict points, IN int* restrict face, IN REAL* restrict barycentric,
                            IN int* restrict frame, IN REAL* restrict codes, IN int* restrict triangles,
                            IN int* restrict joints, IN REAL* restrict weights, IN REAL* restrict centres,
                            GLOBAL REAL* restrict e, int rows, int influences, int joint_count, IN int* count) {
  const int n = get_global_id(0);
  if (n >= live_rows(rows, count)) return;
  REAL sum[3] = {0, 0, 0};
  if (face[n] >= 0) {
    IN REAL* x = points + 3 * n;
    IN REAL* code = codes + (size_t)frame[n] * joint_count * 6;
    for (int corner = 0; corner < 3; ++corner) {
      const int v = triangles[3 * face[n] + corner];
      const REAL share = barycentric[3 * n + corner];
      for (int k = v * influences; k < (v + 1) * influences; ++k) {
        IN REAL* turn = code + 6 * joints[k];
        IN REAL* centre = centres + 3 * joints[k];
        const REAL weight = share * weights[k];
        ADD_CROSS(sum, weight, turn, x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]);
        for (int c = 0; c < 3; ++c) sum[c] += weight * turn[3 + c];
      }
    }
  }
  for (int c = 0; c < 3; ++c) e[3 * n + c] = sum[c];
}

// grad_x = sum_k w_k (g x r_k)
KERNEL void bone_points_gradient(IN int* restrict face, IN REAL* restrict barycentric, IN int* restrict frame,
                                 IN REAL* restrict codes, IN int* restrict triangles, IN int* restrict joints,
                                 IN REAL* restrict weights, IN REAL* restrict grad_e, GLOBAL REAL* restrict grad_x,
                                 int rows, int influences, int joint_count, IN int* count) {
  const int n = get_global_id(0);
  if (n >= live_rows(rows, count)) return;
  IN REAL* g = grad_e + 3 * n;
  REAL gradient[3] = {0, 0, 0};
  if (face[n] >= 0) {
    IN REAL* code = codes + (size_t)frame[n] * joint_count * 6;
    for (int corner = 0; corner < 3; ++corner) {
      const int v = triangles[3 * face[n] + corner];
      const REAL share = barycentric[3 * n + corner];
      for (int k = v * influences; k < (v + 1) * influences; ++k) {
        IN REAL* turn = code + 6 * joints[k];
        ADD_CROSS(gradient, share * weights[k], g, turn[0], turn[1], turn[2]);
      }
    }
  }
  for (int c = 0; c < 3; ++c) grad_x[3 * n + c] = gradient[c];
}

// partial[chunk][frame][k] += w_k ((x - c_k) x g, g)
KERNEL void bone_codes_partials(IN REAL* restrict points, IN int* restrict face, IN REAL* restrict barycentric,
                                IN int* restrict frame, IN int* restrict triangles, IN int* restrict joints,
                                IN REAL* restrict weights, IN REAL* restrict centres, IN REAL* restrict grad_e,
                                GLOBAL REAL* restrict partial, int rows, int influences, int joint_count, int frames,
                                int chunk_rows, IN int* count) {
  const int chunk = get_global_id(0), first_entry = get_global_id(1) * ENTRIES;
  const int first = chunk * chunk_rows, end = min(first + chunk_rows, live_rows(rows, count));
  if (first >= rows || first_entry >= 6) return;
  const size_t code_count = (size_t)frames * joint_count;
  GLOBAL REAL* out = partial + chunk * code_count * 6 + first_entry;
  for (size_t j = 0; j < code_count; ++j)
    for (int entry = 0; entry < ENTRIES; ++entry) out[6 * j + entry] = 0;
  for (int n = first; n < end; ++n) {
    if (face[n] < 0) continue;
    IN REAL* x = points + 3 * n;
    IN REAL* g = grad_e + 3 * n;
    GLOBAL REAL* code = out + (size_t)frame[n] * joint_count * 6;
    for (int corner = 0; corner < 3; ++corner) {
      const int v = triangles[3 * face[n] + corner];
      const REAL share = barycentric[3 * n + corner];
      for (int k = v * influences; k < (v + 1) * influences; ++k) {
        IN REAL* centre = centres + 3 * joints[k];
        const REAL from[3] = {x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]};
        REAL gradient[6] = {0, 0, 0, g[0], g[1], g[2]};
        ADD_CROSS(gradient, 1, from, g[0], g[1], g[2]);
        for (int entry = 0; entry < ENTRIES; ++entry)
          code[6 * joints[k] + entry] += share * weights[k] * gradient[first_entry + entry];
      }
    }
  }
}
