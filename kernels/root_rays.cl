// root_rays: rays [R,3] + [R,3] seen from the posed root joint, whose transform [A | t] maps rest to posed points:
//   origin' = A^T (origin - t) - root    direction' = A^T direction    -> [R,6]
#include "affine.clh"

KERNEL void root_rays(IN REAL* restrict origins, IN REAL* restrict directions, IN REAL* restrict transforms,
                      GLOBAL REAL* restrict rays, REAL root_x, REAL root_y, REAL root_z, int capacity, IN int* count) {
  const int i = get_global_id(0);
  if (i >= live_rows(capacity, count)) return;
  Affine m;
  for (int r = 0; r < 3; ++r)
    m.row[r] = (Vector)(transforms[4 * r], transforms[4 * r + 1], transforms[4 * r + 2], 0);
  m.shift = (Vector)(transforms[3], transforms[7], transforms[11], 0);
  const Vector origin = rotate_transposed(&m, load3(origins, i) - m.shift) - (Vector)(root_x, root_y, root_z, 0);
  const Vector direction = rotate_transposed(&m, load3(directions, i));
  const REAL row[6] = {origin.x, origin.y, origin.z, direction.x, direction.y, direction.z};
  for (int k = 0; k < 6; ++k) rays[6 * i + k] = row[k];
}
