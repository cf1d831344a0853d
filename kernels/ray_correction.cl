// ray_correction: d' = R(r) d and o' = o + unit t, with (r, t) = corrections[frame of the ray's pixel].
//   origins [R,3]  directions [R,3]  pixels i32 [R]  corrections [F,6]  ->  o' [R,3]  d' [R,3]
//
// R is Cayley's rotation, rational and exact: with a = r / 2,
//   d' = d + s u,   s = 2 / (1 + a.a),   u = a x d + a x (a x d) = a x d + a (a.d) - d (a.a).
// One ray per work-item. The gradient of the corrections is summed per chunk of rays into a copy of its own,
// [chunks, F * 6], and the copies are added in order.
#include "common.clh"

#define DOT(a, b) ((a)[0] * (b)[0] + (a)[1] * (b)[1] + (a)[2] * (b)[2])
// Component i of a x b.
#define CROSS(a, b, i) ((a)[((i) + 1) % 3] * (b)[((i) + 2) % 3] - (a)[((i) + 2) % 3] * (b)[((i) + 1) % 3])

KERNEL void ray_correction(IN REAL* restrict origins, IN REAL* restrict directions, IN int* restrict pixels,
                           IN REAL* restrict corrections, GLOBAL REAL* restrict new_origins,
                           GLOBAL REAL* restrict new_directions, int capacity, int frame_pixels, REAL unit,
                           IN int* count) {
  const int ray = get_global_id(0);
  if (ray >= live_rows(capacity, count)) return;
  IN REAL* d = directions + 3 * ray;
  IN REAL* correction = corrections + 6 * (pixels[ray] / frame_pixels);
  const REAL a[3] = {correction[0] / 2, correction[1] / 2, correction[2] / 2};
  const REAL square = DOT(a, a), along = DOT(a, d), s = 2 / (1 + square);
  for (int i = 0; i < 3; ++i) {
    new_directions[3 * ray + i] = d[i] + s * (CROSS(a, d, i) + a[i] * along - d[i] * square);
    new_origins[3 * ray + i] = origins[3 * ray + i] + unit * correction[3 + i];
  }
}

// With g the gradient of d':  grad_a = -s^2 (g.u) a + s (d x g + g (a.d) + d (a.g) - 2 a (g.d)),  grad_r = grad_a / 2.
KERNEL void ray_correction_partials(IN REAL* restrict directions, IN int* restrict pixels,
                                    IN REAL* restrict corrections, IN REAL* restrict grad_origins,
                                    IN REAL* restrict grad_directions, GLOBAL REAL* restrict partial, int capacity,
                                    int frames, int frame_pixels, REAL unit, int chunk_rays, IN int* count) {
  const int chunk = get_global_id(0), first = chunk * chunk_rays;
  if (first >= capacity) return;
  const int end = min(first + chunk_rays, live_rows(capacity, count));
  GLOBAL REAL* sums = partial + (size_t)chunk * frames * 6;
  for (int i = 0; i < 6 * frames; ++i) sums[i] = 0;
  for (int ray = first; ray < end; ++ray) {
    const int frame = pixels[ray] / frame_pixels;
    IN REAL* d = directions + 3 * ray;
    IN REAL* g = grad_directions + 3 * ray;
    IN REAL* r = corrections + 6 * frame;
    const REAL a[3] = {r[0] / 2, r[1] / 2, r[2] / 2};
    const REAL square = DOT(a, a), s = 2 / (1 + square), a_d = DOT(a, d), a_g = DOT(a, g), g_d = DOT(g, d);
    const REAL d_x_g[3] = {CROSS(d, g, 0), CROSS(d, g, 1), CROSS(d, g, 2)};
    const REAL g_u = DOT(a, d_x_g) + a_g * a_d - g_d * square;
    for (int i = 0; i < 3; ++i) {
      const REAL grad_a = s * (d_x_g[i] + g[i] * a_d + d[i] * a_g - 2 * a[i] * g_d) - s * s * g_u * a[i];
      sums[6 * frame + i] += grad_a / 2;
      sums[6 * frame + 3 + i] += unit * grad_origins[3 * ray + i];
    }
  }
}
