// peak_depth: one work-item per ray finds the sample of the greatest weight for its length, and takes the mean depth of it
// and its neighbours. Lengths count by the depth, as samples are longer far away; that of the last sample, which may be
// endless, is its neighbour's.
//   weight, depths [R,S]  ->  depth [R]
//
//   weight      fog   wall
//          . : : . : . |
//          . : : . : : | .      the wall: fog may weigh more in all
#include "common.clh"

// Of sample s, which is `depths[s + 1] - depths[s]` long.
inline REAL relative_length(IN REAL* depths, int s, int samples) {
  if (samples == 1) return 1;
  const int first = min(s, samples - 2);
  return fmax((depths[first + 1] - depths[first]) / fmax(depths[first + 1], (REAL)1e-30), (REAL)1e-6);
}

KERNEL void peak_depth(IN REAL* restrict weight, IN REAL* restrict depths, GLOBAL REAL* restrict depth, int rays,
                       int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  IN REAL* w = weight + (size_t)ray * samples;
  IN REAL* t = depths + (size_t)ray * samples;
  int peak = 0;
  REAL greatest = 0;
  for (int s = 0; s < samples; ++s) {
    const REAL found = w[s] / relative_length(t, s, samples);
    if (found <= greatest) continue;
    greatest = found;
    peak = s;
  }
  REAL sum = 0, moment = 0;
  for (int s = max(peak - 1, 0); s <= min(peak + 1, samples - 1); ++s) {
    sum += w[s];
    moment += w[s] * t[s];
  }
  depth[ray] = sum > 0 ? moment / sum : 0;
}
