// rays: where rays meet a box or a shell, points along them, and points in normalised space. One ray, sample or point per
// work-item.
#include "common.clh"
#ifndef CONTRACT
#define CONTRACT 0
#endif

// box [2,3], or [R,6] with a stride of 6 numbers per ray. A ray along a face's plane counts as inside.
KERNEL void ray_box(IN REAL* restrict origins, IN REAL* restrict directions, IN REAL* restrict box,
                    GLOBAL REAL* restrict near, GLOBAL REAL* restrict far, int capacity, int box_stride, REAL nearest,
                    IN int* count) {
  const int ray = get_global_id(0);
  if (ray >= live_rows(capacity, count)) return;
  IN REAL* lower = box + (size_t)ray * box_stride;
  REAL enter = nearest, leave = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    const REAL o = origins[3 * ray + axis], d = directions[3 * ray + axis];
    const REAL to_lower = lower[axis] - o, to_upper = lower[axis + 3] - o;
    if (d != 0) {
      enter = fmax(enter, fmin(to_lower / d, to_upper / d));
      leave = fmin(leave, fmax(to_lower / d, to_upper / d));
    } else if (to_lower > 0 || to_upper < 0) {
      leave = -INFINITY;
    }
  }
  const int hit = leave > enter;
  near[ray] = hit ? enter : 0;
  far[ray] = hit ? leave : 0;
}

// How far a ray runs until it leaves a ball around the origin of which a floor cuts off the part below
// `normal . x = -floor`. Rays that miss the ball: the point nearest to its centre.
inline REAL leave_shell(const REAL* o, const REAL* d, REAL radius, const REAL* normal, REAL floor) {
  const REAL along = o[0] * d[0] + o[1] * d[1] + o[2] * d[2];
  const REAL beside[3] = {o[0] - along * d[0], o[1] - along * d[1], o[2] - along * d[2]};
  const REAL inside =
      radius * radius - (beside[0] * beside[0] + beside[1] * beside[1] + beside[2] * beside[2]);
  REAL depth = sqrt(fmax(inside, (REAL)0)) - along;
  const REAL height = normal[0] * o[0] + normal[1] * o[1] + normal[2] * o[2] + floor;
  const REAL falling = -(normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]);
  if (height > 0 && falling * depth > height) depth = height / falling;
  return depth;
}

KERNEL void ray_shell(IN REAL* restrict origins, IN REAL* restrict directions, GLOBAL REAL* restrict near,
                      GLOBAL REAL* restrict far, int capacity, REAL centre_x, REAL centre_y, REAL centre_z,
                      REAL inner_radius, REAL outer_radius, REAL normal_x, REAL normal_y, REAL normal_z,
                      REAL inner_floor, REAL outer_floor, IN int* count) {
  const int ray = get_global_id(0);
  if (ray >= live_rows(capacity, count)) return;
  const REAL o[3] = {origins[3 * ray] - centre_x, origins[3 * ray + 1] - centre_y, origins[3 * ray + 2] - centre_z};
  const REAL d[3] = {directions[3 * ray], directions[3 * ray + 1], directions[3 * ray + 2]};
  const REAL normal[3] = {normal_x, normal_y, normal_z};
  const REAL least = (REAL)1e-3 * inner_radius;
  near[ray] = fmax(leave_shell(o, d, inner_radius, normal, inner_floor), least);
  far[ray] = fmax(leave_shell(o, d, outer_radius, normal, outer_floor), near[ray] + least);
}

KERNEL void points_on_rays(IN REAL* restrict origins, IN REAL* restrict directions, IN REAL* restrict depths,
                           GLOBAL REAL* restrict points, int rays, int samples) {
  const int i = get_global_id(0), ray = i / samples;
  if (ray >= rays) return;
  const REAL depth = depths[i];
  for (int axis = 0; axis < 3; ++axis)
    points[3 * (size_t)i + axis] = origins[3 * ray + axis] + depth * directions[3 * ray + axis];
}

// grad_origin = sum of a ray's gradients, grad_direction = sum of them times the depths; one ray per work-item.
KERNEL void points_on_rays_gradient(IN REAL* restrict depths, IN REAL* restrict grad_points,
                                    GLOBAL REAL* restrict grad_origins, GLOBAL REAL* restrict grad_directions, int rays,
                                    int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  REAL origin[3] = {0, 0, 0}, direction[3] = {0, 0, 0};
  for (size_t i = (size_t)ray * samples; i < (size_t)(ray + 1) * samples; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      origin[axis] += grad_points[3 * i + axis];
      direction[axis] += depths[i] * grad_points[3 * i + axis];
    }
  for (int axis = 0; axis < 3; ++axis) {
    grad_origins[3 * ray + axis] = origin[axis];
    grad_directions[3 * ray + axis] = direction[axis];
  }
}

// y = (x - centre) * scale, then contracted or not.
KERNEL void normalise_points(IN REAL* restrict points, GLOBAL REAL* restrict y, REAL centre_x, REAL centre_y,
                             REAL centre_z, REAL scale_x, REAL scale_y, REAL scale_z, int capacity, IN int* count) {
  const int i = get_global_id(0);
  if (i >= live_rows(capacity, count)) return;
  IN REAL* x = points + 3 * (size_t)i;
  REAL a = (x[0] - centre_x) * scale_x, b = (x[1] - centre_y) * scale_y, c = (x[2] - centre_z) * scale_z;
#if CONTRACT
  const REAL inverse = 1 / fmax(fmax(fabs(a), fabs(b)), fmax(fabs(c), (REAL)1));
  const REAL factor = (REAL)0.5 * (2 - inverse) * inverse;
  a *= factor;
  b *= factor;
  c *= factor;
#endif
  y[3 * (size_t)i] = a;
  y[3 * (size_t)i + 1] = b;
  y[3 * (size_t)i + 2] = c;
}

KERNEL void normalise_points_gradient(IN REAL* restrict points, IN REAL* restrict grad_y,
                                      GLOBAL REAL* restrict grad_points, REAL centre_x, REAL centre_y, REAL centre_z,
                                      REAL scale_x, REAL scale_y, REAL scale_z, int capacity, IN int* count) {
  const int i = get_global_id(0);
  if (i >= live_rows(capacity, count)) return;
  REAL g[3] = {grad_y[3 * (size_t)i], grad_y[3 * (size_t)i + 1], grad_y[3 * (size_t)i + 2]};
#if CONTRACT
  IN REAL* x = points + 3 * (size_t)i;
  const REAL a = (x[0] - centre_x) * scale_x, b = (x[1] - centre_y) * scale_y, c = (x[2] - centre_z) * scale_z;
  const REAL largest = fmax(fmax(fabs(a), fabs(b)), fabs(c)), inverse = 1 / fmax(largest, (REAL)1);
  const REAL factor = (REAL)0.5 * (2 - inverse) * inverse;
  // d factor / d largest, for the coordinate that is the largest
  const REAL slope = largest > 1 ? inverse * inverse * (inverse - 1) : 0;
  const REAL along = slope * (g[0] * a + g[1] * b + g[2] * c);
  g[0] = g[0] * factor + (fabs(a) == largest ? (a > 0 ? along : -along) : 0);
  g[1] = g[1] * factor + (fabs(b) == largest ? (b > 0 ? along : -along) : 0);
  g[2] = g[2] * factor + (fabs(c) == largest ? (c > 0 ? along : -along) : 0);
#endif
  grad_points[3 * (size_t)i] = g[0] * scale_x;
  grad_points[3 * (size_t)i + 1] = g[1] * scale_y;
  grad_points[3 * (size_t)i + 2] = g[2] * scale_z;
}
