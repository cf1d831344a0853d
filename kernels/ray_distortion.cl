// ray_distortion: how far the weight of a ray is spread, one work-item per ray. With the samples' intervals from s_i to
// s_{i+1} in the ray's own distance (near 0, far 1, SPACING as samples are spread), their middles m_i and lengths l_i:
//   y = sum_ij w_i w_j |m_i - m_j| + 1/3 sum_i w_i^2 l_i
//   weight, depths [R,S], near, far [R]  ->  y [R]
//
// Sums over pairs come from running sums: W of w, M of w m, over the samples before i.
//   sum_ij w_i w_j |m_i - m_j| = 2 sum_i w_i (m_i W_i - M_i)
//   d y / d w_i = 2 (m_i W_i - M_i) + 2 (M'_i - m_i W'_i) + 2/3 w_i l_i,   W', M' over the samples behind i
#include "common.clh"
#define LINEAR 0
#define DISPARITY 1
#ifndef SPACING
#define SPACING LINEAR
#endif

// The ray's own distance of a depth.
inline REAL own_distance(REAL depth, REAL near, REAL far) {
  const REAL part = (depth - near) / fmax(far - near, (REAL)1e-30);
#if SPACING == LINEAR
  return part;
#else
  return part * far / fmax(depth, (REAL)1e-30);
#endif
}

KERNEL void ray_distortion(IN REAL* restrict weight, IN REAL* restrict depths, IN REAL* restrict near,
                           IN REAL* restrict far, GLOBAL REAL* restrict y, int rays, int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  IN REAL *w = weight + (size_t)ray * samples, *t = depths + (size_t)ray * samples;
  REAL before = 0, moment = 0, total = 0, begin = own_distance(t[0], near[ray], far[ray]);
  for (int i = 0; i < samples; ++i) {
    const REAL end = i < samples - 1 ? own_distance(t[i + 1], near[ray], far[ray]) : 1;
    const REAL middle = (begin + end) / 2;
    total += w[i] * (2 * (middle * before - moment) + w[i] * (end - begin) / 3);
    before += w[i];
    moment += w[i] * middle;
    begin = end;
  }
  y[ray] = total;
}

KERNEL void ray_distortion_gradient(IN REAL* restrict weight, IN REAL* restrict depths, IN REAL* restrict near,
                                    IN REAL* restrict far, IN REAL* restrict grad_y,
                                    GLOBAL REAL* restrict grad_weight, int rays, int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  IN REAL *w = weight + (size_t)ray * samples, *t = depths + (size_t)ray * samples;
  GLOBAL REAL* grad = grad_weight + (size_t)ray * samples;
  const REAL factor = 2 * grad_y[ray];
  REAL before = 0, moment = 0, begin = own_distance(t[0], near[ray], far[ray]);
  for (int i = 0; i < samples; ++i) {
    const REAL end = i < samples - 1 ? own_distance(t[i + 1], near[ray], far[ray]) : 1;
    const REAL middle = (begin + end) / 2;
    grad[i] = factor * (middle * before - moment + w[i] * (end - begin) / 3);
    before += w[i];
    moment += w[i] * middle;
    begin = end;
  }
  REAL behind = 0, moment_behind = 0, end = 1;
  for (int i = samples - 1; i >= 0; --i) {
    begin = own_distance(t[i], near[ray], far[ray]);
    const REAL middle = (begin + end) / 2;
    grad[i] += factor * (moment_behind - middle * behind);
    behind += w[i];
    moment_behind += w[i] * middle;
    end = begin;
  }
}
