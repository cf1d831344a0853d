// triplane_sample: bilinear samples of three planes at points, multiplied or added.
//   planes [3,H,W,C]  points [N,3]  ->  y [N,C]
//
//   plane 0 xy: column x, row y        texels of a sample, with weights (1-fu)(1-fv) ... fu fv:
//   plane 1 xz: column x, row z           0 --fu-- 1
//   plane 2 yz: column y, row z           fv       |     u = (x+1)/2 W - 0.5, clamped to [0, W-1]
//                                         2 ------ 3
#include "lanes.clh"
#define PRODUCT 0
#define SUM 1
#ifndef COMBINE
#define COMBINE PRODUCT
#endif
#define FOR_PLANES UNROLL for (int p = 0; p < 3; ++p)

typedef struct {
  int texel[4];  // offsets into the planes
  REAL fu, fv;  // position between the texels
  REAL su, sv;  // d column / d coordinate and d row / d coordinate: 0 where clamped
} Footprint;

// The position along one axis of `extent` pixels: its lower pixel; *fraction and *slope.
inline int axis_position(REAL coordinate, int extent, REAL* fraction, REAL* slope) {
  const REAL scale = (REAL)0.5 * extent, u = (coordinate + 1) * scale - (REAL)0.5;
  const REAL clamped = fmin(fmax(u, (REAL)0), (REAL)(extent - 1));
  const int lower = min((int)clamped, max(extent - 2, 0));
  *fraction = clamped - lower;
  *slope = u == clamped ? scale : 0;
  return lower;
}

inline Footprint footprint(int plane, IN REAL* point, int height, int width) {
  Footprint f;
  const int u = axis_position(point[plane == 2], width, &f.fu, &f.su);
  const int v = axis_position(point[plane == 0 ? 1 : 2], height, &f.fv, &f.sv);
  const int right = width > 1 ? CHANNELS : 0, down = height > 1 ? width * CHANNELS : 0;
  f.texel[0] = ((plane * height + v) * width + u) * CHANNELS;
  f.texel[1] = f.texel[0] + right;
  f.texel[2] = f.texel[0] + down;
  f.texel[3] = f.texel[2] + right;
  return f;
}

inline LANE bilinear(IN REAL* planes, const Footprint* f) {
  const LANE upper = LOAD(planes + f->texel[0]) * (1 - f->fu) + LOAD(planes + f->texel[1]) * f->fu;
  const LANE lower = LOAD(planes + f->texel[2]) * (1 - f->fu) + LOAD(planes + f->texel[3]) * f->fu;
  return upper * (1 - f->fv) + lower * f->fv;
}

// d y / d sample_p
inline LANE others(const LANE* sample, int p) {
#if COMBINE == PRODUCT
  return sample[p == 0 ? 1 : 0] * sample[p == 2 ? 1 : 2];
#else
  return (LANE)(1);
#endif
}

KERNEL void triplane_sample(IN REAL* restrict planes, IN REAL* restrict points, GLOBAL REAL* restrict y, int capacity,
                            int height, int width, int block, IN int* count) {
  const int first_vector = get_global_id(0) * VECTORS_PER_ITEM, first = get_global_id(1) * block;
  const int end = min(first + block, live_rows(capacity, count));
  if (first_vector >= VECTORS) return;
  for (int i = first; i < end; ++i) {
    IN REAL* point = points + (size_t)i * 3;
    Footprint f[3];
    FOR_PLANES f[p] = footprint(p, point, height, width);
    UNROLL for (int v = first_vector; v < first_vector + VECTORS_PER_ITEM; ++v) {
      LANE sample[3];
      FOR_PLANES sample[p] = bilinear(planes + v * LANES, &f[p]);
#if COMBINE == PRODUCT
      STORE(sample[0] * sample[1] * sample[2], y + (size_t)i * CHANNELS + v * LANES);
#else
      STORE(sample[0] + sample[1] + sample[2], y + (size_t)i * CHANNELS + v * LANES);
#endif
    }
  }
}

// grad_points [N,3]; a work-item takes all channels of `block` points in both forms.
KERNEL void triplane_points_gradient(IN REAL* restrict planes, IN REAL* restrict points, IN REAL* restrict grad_y,
                                     GLOBAL REAL* restrict grad_points, int capacity, int height, int width, int block,
                                     IN int* count) {
  const int first = get_global_id(0) * block, end = min(first + block, live_rows(capacity, count));
  for (int i = first; i < end; ++i) {
    IN REAL* point = points + (size_t)i * 3;
    Footprint f[3];
    LANE du[3], dv[3];
    FOR_PLANES {
      f[p] = footprint(p, point, height, width);
      du[p] = dv[p] = (LANE)(0);
    }
    for (int v = 0; v < VECTORS; ++v) {
      const LANE grad = LOAD(grad_y + (size_t)i * CHANNELS + v * LANES);
      LANE sample[3], across[3], down[3];
      FOR_PLANES {
        IN REAL* texels = planes + v * LANES;
        const LANE t0 = LOAD(texels + f[p].texel[0]), t1 = LOAD(texels + f[p].texel[1]);
        const LANE t2 = LOAD(texels + f[p].texel[2]), t3 = LOAD(texels + f[p].texel[3]);
        const LANE upper = t0 + (t1 - t0) * f[p].fu, lower = t2 + (t3 - t2) * f[p].fu;
        sample[p] = upper + (lower - upper) * f[p].fv;
        across[p] = (t1 - t0) * (1 - f[p].fv) + (t3 - t2) * f[p].fv;
        down[p] = lower - upper;
      }
      FOR_PLANES {
        const LANE weight = grad * others(sample, p);
        du[p] += weight * across[p];
        dv[p] += weight * down[p];
      }
    }
    REAL u[3], w[3];
    FOR_PLANES {
      u[p] = sum_lanes(du[p]) * f[p].su;
      w[p] = sum_lanes(dv[p]) * f[p].sv;
    }
    GLOBAL REAL* grad_point = grad_points + (size_t)i * 3;
    grad_point[0] = u[0] + u[1];
    grad_point[1] = w[0] + u[2];
    grad_point[2] = w[1] + w[2];
  }
}

// partial [partitions,3,H,W,C]: one work-item per partition of the points and vector of channels, which clears and
// fills its own copy of all three planes in one pass over its points.
KERNEL void triplane_planes_gradient(IN REAL* restrict planes, IN REAL* restrict points, IN REAL* restrict grad_y,
                                     GLOBAL REAL* restrict partial, int capacity, int height, int width,
                                     int partitions, IN int* count) {
  const int v = get_global_id(0), partition = get_global_id(1);
  if (v >= VECTORS || partition >= partitions) return;
  const int rows = live_rows(capacity, count), share = (rows + partitions - 1) / partitions;
  const int first = partition * share, end = min(first + share, rows), texels = 3 * height * width;
  GLOBAL REAL* sums = partial + (size_t)partition * texels * CHANNELS + v * LANES;
  for (int t = 0; t < texels; ++t) STORE((LANE)(0), sums + (size_t)t * CHANNELS);
  for (int i = first; i < end; ++i) {
    IN REAL* point = points + (size_t)i * 3;
    const LANE grad = LOAD(grad_y + (size_t)i * CHANNELS + v * LANES);
    Footprint f[3];
    LANE sample[3];
    FOR_PLANES {
      f[p] = footprint(p, point, height, width);
      sample[p] = bilinear(planes + v * LANES, &f[p]);
    }
    FOR_PLANES {
      const LANE weight = grad * others(sample, p);
      const LANE right = weight * f[p].fu, left = weight - right;
      const LANE part[4] = {left * (1 - f[p].fv), right * (1 - f[p].fv), left * f[p].fv, right * f[p].fv};
      UNROLL for (int t = 0; t < 4; ++t) {
        GLOBAL REAL* target = sums + f[p].texel[t];
        STORE(LOAD(target) + part[t], target);
      }
    }
  }
}
