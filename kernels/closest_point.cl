// closest_point: for each point [N,3] the closest triangle of a mesh (see mesh_tree.clh), the weights of its corners,
// the signed distance and the closest point.
//
// A work-item serves QUERIES points, one after the other: on CPUs the 16 lanes work on one point's boxes and triangles.
#include "mesh_tree.clh"

#ifndef QUERIES
#define QUERIES 16
#endif

KERNEL void closest_point(IN REAL* restrict points, IN REAL* restrict vertices, IN REAL* restrict leaves,
                          IN REAL* restrict bounds, IN REAL* restrict normals, IN int* restrict triangles,
                          IN int* restrict leaf_triangles, IN int* restrict neighbours, GLOBAL int* restrict face,
                          GLOBAL REAL* restrict barycentric, GLOBAL REAL* restrict distance,
                          GLOBAL REAL* restrict closest, int leaf_count, REAL max_distance, int capacity,
                          IN int* count) {
  const int first = get_global_id(0) * QUERIES, end = min(first + QUERIES, live_rows(capacity, count));
  const Tree tree = tree_over(leaf_count);
  for (int i = first; i < end; ++i) {
    const Vector query = load3(points, i);
    REAL away;
    const int slot = closest_slot(bounds, leaves, &tree, query.x, query.y, query.z, max_distance, &away);
    const int found = slot < 0 ? -1 : leaf_triangles[slot];
    Foot foot;
    foot.point = query;
    foot.weight[0] = foot.weight[1] = foot.weight[2] = 0;
    REAL signed_to = max_distance;
    if (found >= 0) {
      IN int* corner = triangles + 3 * found;
      foot = closest_on_triangle(query, load3(vertices, corner[0]), load3(vertices, corner[1]),
                                 load3(vertices, corner[2]));
      signed_to = signed_distance(query, foot.point,
                                  pseudo_normal(foot, found, vertices, normals, triangles, neighbours));
    }
    face[i] = found;
    distance[i] = signed_to;
    for (int k = 0; k < 3; ++k) barycentric[3 * i + k] = foot.weight[k];
    closest[3 * i] = foot.point.x;
    closest[3 * i + 1] = foot.point.y;
    closest[3 * i + 2] = foot.point.z;
  }
}
