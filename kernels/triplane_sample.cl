// triplane_sample: bilinear samples of three planes (triplane.clh) at points, multiplied or added.
//   planes [3,H,W,C]  points [N,3]  ->  y [N,C]
#include "triplane.clh"

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
