// stratified_samples: one sample in each of S strata of [near, far], ascending.
//
//   near |  .  |.    |   . | .   | far        depth_s at fraction (s + u) / S, u random or 1/2
//        stratum 0   1 ...                    delta_s = depth_{s+1} - depth_s, the last one far - depth_s
//
// Four samples of a ray per work-item: the words of random block ray * ceil(S / 4) + s / 4.
#include "philox.clh"
#define LINEAR 0
#define DISPARITY 1
#ifndef SPACING
#define SPACING LINEAR
#endif

KERNEL void stratified_depths(IN REAL* restrict near, IN REAL* restrict far, IN int* seed, IN int* step,
                              GLOBAL REAL* restrict depths, int stream, int jitter, int rays, int samples) {
  const int blocks = (samples + 3) / 4, block = get_global_id(0), ray = get_global_id(1), first = 4 * block;
  if (ray >= rays || block >= blocks) return;
  const REAL a = near[ray], b = far[ray];
  uint words[4];
  if (jitter) philox(ray * blocks + block, step[0], seed[0], stream, words);
  for (int k = 0; k < min(4, samples - first); ++k) {
    const REAL fraction = (first + k + (jitter ? unit_interval(words[k]) : (REAL)0.5)) / samples;
#if SPACING == LINEAR
    const REAL depth = a + (b - a) * fraction;
#else
    // 1 / depth runs from 1 / a to 1 / b; 0 where both are 0
    const REAL depth = a * b / fmax(b + (a - b) * fraction, (REAL)1e-30);
#endif
    depths[(size_t)ray * samples + first + k] = depth;
  }
}

KERNEL void sample_intervals(IN REAL* restrict depths, IN REAL* restrict far, GLOBAL REAL* restrict deltas, int rays,
                             int samples) {
  const int s = get_global_id(0), ray = get_global_id(1);
  if (ray >= rays || s >= samples) return;
  const size_t i = (size_t)ray * samples + s;
  deltas[i] = (s == samples - 1 ? far[ray] : depths[i + 1]) - depths[i];
}
