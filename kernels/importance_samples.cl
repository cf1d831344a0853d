// importance_samples: depths where a ray's weight is, drawn by inverting its distribution; one work-item per ray.
//
//   weight   .  :  |  :  .        bins between the coarse depths, the first from near, the last to far
//          near .. t1 t2 .. far   a bin's mass is the mean of the larger of its weight and either neighbour's, so that a
//                                 surface that the coarse samples just missed is looked at too, and a share for all alike
//
//   depths, weight [R,S], near, far [R]  ->  drawn [R,N], ascending: fraction (k + u) / N of the mass, u random or 1/2
#include "philox.clh"

// The mass that all bins share alike, to that of the weight, which is 1 on opaque rays.
#define EVERYWHERE (REAL)0.3

inline REAL bin_mass(IN REAL* w, int i, int bins) {
  const REAL here = fmax(w[i], (REAL)0);  // 0 for what is not a number
  const REAL before = i > 0 ? fmax(w[i - 1], here) : here, behind = i < bins - 1 ? fmax(w[i + 1], here) : here;
  return (before + behind) / 2 + EVERYWHERE / bins;
}

KERNEL void importance_samples(IN REAL* restrict depths, IN REAL* restrict weight, IN REAL* restrict near,
                               IN REAL* restrict far, IN int* seed, IN int* step, GLOBAL REAL* restrict drawn,
                               int stream, int jitter, int rays, int bins, int number) {
  const int ray = get_global_id(0), blocks = (number + 3) / 4;
  if (ray >= rays) return;
  IN REAL *t = depths + (size_t)ray * bins, *w = weight + (size_t)ray * bins;
  REAL total = 0;
  for (int i = 0; i < bins; ++i) total += bin_mass(w, i, bins);
  int bin = 0;
  REAL passed = 0, mass = bin_mass(w, 0, bins);
  uint words[4];
  for (int k = 0; k < number; ++k) {
    if (jitter && k % 4 == 0) philox(ray * blocks + k / 4, step[0], seed[0], stream, words);
    const REAL wanted = total * ((k + (jitter ? unit_interval(words[k % 4]) : (REAL)0.5)) / number);
    while (bin < bins - 1 && passed + mass < wanted) {
      passed += mass;
      mass = bin_mass(w, ++bin, bins);
    }
    const REAL begin = bin == 0 ? near[ray] : t[bin], end = bin == bins - 1 ? far[ray] : t[bin + 1];
    drawn[(size_t)ray * number + k] = begin + (end - begin) * clamp((wanted - passed) / mass, (REAL)0, (REAL)1);
  }
}
