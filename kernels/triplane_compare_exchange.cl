// triplane_compare_exchange: the planes' gradient of triplane_scatter.cl as OpenCL 1.2 has atomic additions of floats: a
// loop of compare and exchange for every channel of every texel. Its bits depend on the order in which work-items come,
// so no op uses it: scripts/compare-peers measures the product's kernel beside it.
//   gradient [3,H,W,C], zeros before; one work-item per `block` points. fp32, and more than one lane.
#include "triplane.clh"

inline void add_atomically(volatile GLOBAL float* target, float part) {
  union {
    float number;
    uint bits;
  } before, after;
  do {
    before.number = *target;
    after.number = before.number + part;
  } while (atomic_cmpxchg((volatile GLOBAL uint*)target, before.bits, after.bits) != before.bits);
}

KERNEL void triplane_compare_exchange(IN REAL* restrict planes, IN REAL* restrict points, IN REAL* restrict grad_y,
                                      GLOBAL REAL* gradient, int capacity, int height, int width, int block) {
  const int first = get_global_id(0) * block, end = min(first + block, capacity);
  for (int i = first; i < end; ++i) {
    IN REAL* point = points + (size_t)i * 3;
    Footprint f[3];
    FOR_PLANES f[p] = footprint(p, point, height, width);
    for (int v = 0; v < VECTORS; ++v) {
      LANE sample[3];
      FOR_PLANES sample[p] = bilinear(planes + v * LANES, &f[p]);
      const LANE grad = LOAD(grad_y + (size_t)i * CHANNELS + v * LANES);
      FOR_PLANES {
        const LANE weight = grad * others(sample, p), right = weight * f[p].fu, left = weight - right;
        const LANE part[4] = {left * (1 - f[p].fv), right * (1 - f[p].fv), left * f[p].fv, right * f[p].fv};
        for (int t = 0; t < 4; ++t) {
          REAL lanes[LANES];
          JOIN(vstore, LANES)(part[t], 0, lanes);
          for (int c = 0; c < LANES; ++c) add_atomically(gradient + f[p].texel[t] + v * LANES + c, lanes[c]);
        }
      }
    }
  }
}
