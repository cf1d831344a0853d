// mesh_refit: the bounds of the hierarchy of mesh_tree.clh and the normals of a mesh in a new pose.
//   refit_leaves    one work-item per leaf slot: 16 triangles side by side, and their box in the parent's row
//   refit_level     one work-item per slot of a level: the box around the children of one node of the level below
//   vertex_normals  one work-item per vertex: the unit normals of its triangles, weighted by their angles there
#include "mesh_tree.clh"

#define EMPTY ((REAL)1e18)

// Box `slot` of the nodes from `first` on: (low, high), or empty.
inline void store_box(GLOBAL REAL* bounds, int first, int slot, Vector low, Vector high) {
  GLOBAL REAL* row = bounds + (size_t)(first + slot / WIDTH) * BOUND_ROWS * WIDTH + slot % WIDTH;
  row[0 * WIDTH] = low.x;
  row[1 * WIDTH] = low.y;
  row[2 * WIDTH] = low.z;
  row[3 * WIDTH] = high.x;
  row[4 * WIDTH] = high.y;
  row[5 * WIDTH] = high.z;
}

KERNEL void refit_leaves(IN REAL* restrict vertices, IN int* restrict triangles, IN int* restrict leaf_triangles,
                         GLOBAL REAL* restrict leaves, GLOBAL REAL* restrict bounds, int leaf_count, int slots) {
  const int leaf = get_global_id(0);
  if (leaf >= slots) return;
  Vector low = (Vector)(EMPTY), high = (Vector)(-EMPTY);
  if (leaf < leaf_count)
    for (int lane = 0; lane < WIDTH; ++lane) {
      IN int* corner = triangles + 3 * leaf_triangles[leaf * WIDTH + lane];
      const Vector a = load3(vertices, corner[0]), b = load3(vertices, corner[1]), c = load3(vertices, corner[2]);
      const Vector ab = b - a, ac = c - a;
      const REAL bb = dot(ab, ab), cc = dot(ac, ac), bc = dot(ab, ac), area = bb * cc - bc * bc;
      const REAL rows[LEAF_ROWS] = {a.x,
                                    a.y,
                                    a.z,
                                    ab.x,
                                    ab.y,
                                    ab.z,
                                    ac.x,
                                    ac.y,
                                    ac.z,
                                    1 / max(bb, TINY),
                                    1 / max(cc, TINY),
                                    1 / max(bb + cc - 2 * bc, TINY),
                                    area > FLAT_SINE_SQUARED * bb * cc ? 1 / area : 0};
      for (int r = 0; r < LEAF_ROWS; ++r) leaves[((size_t)leaf * LEAF_ROWS + r) * WIDTH + lane] = rows[r];
      low = min(low, min(a, min(b, c)));
      high = max(high, max(a, max(b, c)));
    }
  store_box(bounds, 0, leaf, low, high);
}

// Nodes [child_first, child_first + child_count) of one level become boxes of the nodes from parent_first on.
KERNEL void refit_level(GLOBAL REAL* restrict bounds, int child_first, int child_count, int parent_first, int slots) {
  const int child = get_global_id(0);
  if (child >= slots) return;
  Vector low = (Vector)(EMPTY), high = (Vector)(-EMPTY);
  if (child < child_count) {
    const GLOBAL REAL* row = bounds + (size_t)(child_first + child) * BOUND_ROWS * WIDTH;
    for (int i = 0; i < WIDTH; ++i, ++row) {
      low = min(low, (Vector)(row[0], row[WIDTH], row[2 * WIDTH], 0));
      high = max(high, (Vector)(row[3 * WIDTH], row[4 * WIDTH], row[5 * WIDTH], 0));
    }
  }
  store_box(bounds, parent_first, child, low, high);
}

KERNEL void vertex_normals(IN REAL* restrict vertices, IN int* restrict triangles, IN int* restrict corner_offsets,
                           IN int* restrict corners, GLOBAL REAL* restrict normals, int vertex_count) {
  const int v = get_global_id(0);
  if (v >= vertex_count) return;
  const Vector here = load3(vertices, v);
  Vector sum = (Vector)(0);
  for (int i = corner_offsets[v]; i < corner_offsets[v + 1]; ++i) {
    IN int* triangle = triangles + corners[i] / 3 * 3;
    const int k = corners[i] % 3;
    const Vector next = load3(vertices, triangle[(k + 1) % 3]) - here, before = load3(vertices, triangle[(k + 2) % 3]) - here;
    const Vector n = cross(next, before);
    const REAL area = sqrt(dot(n, n));
    sum += n * (atan2(area, dot(next, before)) / max(area, TINY));
  }
  const Vector normal = sum / max(sqrt(dot(sum, sum)), TINY);
  normals[3 * v] = normal.x;
  normals[3 * v + 1] = normal.y;
  normals[3 * v + 2] = normal.z;
}
