// peak_depth: one work-item per ray finds the sample of the greatest weight, the first of equal ones, and takes the
// mean depth of it and its neighbours.
//   weight, depths [R,S]  ->  depth [R]
//
//   weight      fog   wall
//          . : : . : . |
//          . : : . : : | .      the wall: fog may weigh more in all
#include "common.clh"

KERNEL void peak_depth(IN REAL* restrict weight, IN REAL* restrict depths, GLOBAL REAL* restrict depth, int rays,
                       int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  IN REAL* w = weight + (size_t)ray * samples;
  IN REAL* t = depths + (size_t)ray * samples;
  int peak = 0;
  for (int s = 1; s < samples; ++s)
    if (w[s] > w[peak]) peak = s;
  REAL sum = 0, moment = 0;
  for (int s = max(peak - 1, 0); s <= min(peak + 1, samples - 1); ++s) {
    sum += w[s];
    moment += w[s] * t[s];
  }
  depth[ray] = sum > 0 ? moment / sum : 0;
}
