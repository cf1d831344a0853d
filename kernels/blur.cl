// blur: one axis of a separable blur with reflected borders, or its adjoint.
//
//   The tensor is [outer, n, inner]; taps[d] is the weight at distance d <= radius < n. With the border reflected,
//   x[a] contributes to y[b] by its distance and by those of its mirror images at -a and 2 (n - 1) - a:
//
//        -a        0    a                n-1        2(n-1)-a          W(a, b) = taps[|a - b|]
//     ....o........|....o.................|..............o....                + taps[a + b]             if a > 0
//                                                                             + taps[2(n-1) - a - b]    if a < n - 1
//   y[b] = sum_a W(a, b) x[a];   adjoint: y[b] = sum_a W(b, a) x[a]
//
// One vector of VW elements of a slab [n, inner] per work-item.
#include "common.clh"

inline REAL tap(IN REAL* taps, int distance, int radius) { return distance <= radius ? taps[distance] : 0; }

inline REAL reflected_weight(IN REAL* taps, int radius, int n, int a, int b) {
  REAL weight = tap(taps, abs(a - b), radius);
  if (a > 0) weight += tap(taps, a + b, radius);
  if (a < n - 1) weight += tap(taps, 2 * (n - 1) - a - b, radius);
  return weight;
}

KERNEL void blur_axis(IN REAL* restrict x, IN REAL* restrict taps, GLOBAL REAL* restrict y, int outer, int n, int inner,
                      int radius, int adjoint) {
  const int e = get_global_id(0) * VW, slab = get_global_id(1), elements = n * inner;
  if (e >= elements || slab >= outer) return;
  IN REAL* source = x + (size_t)slab * elements;
  GLOBAL REAL* target = y + (size_t)slab * elements;
  const int first = e / inner, last = (e + VW - 1) / inner;
  if (first >= radius + 1 && last + radius + 1 < n) {  // no mirror image is near
    REALV sum = taps[0] * VLOAD(0, source + e);
    for (int d = 1; d <= radius; ++d)
      sum += taps[d] * (VLOAD(0, source + e - d * inner) + VLOAD(0, source + e + d * inner));
    VSTORE(sum, 0, target + e);
  } else if (first == last && e + VW <= elements) {  // one position for all lanes
    REALV sum = (REALV)(0);
    for (int a = max(0, first - radius); a <= min(n - 1, first + radius); ++a)
      sum += reflected_weight(taps, radius, n, adjoint ? first : a, adjoint ? a : first) *
             VLOAD(0, source + e + (a - first) * inner);
    VSTORE(sum, 0, target + e);
  } else {
    for (int k = e; k < min(e + VW, elements); ++k) {
      const int b = k / inner;
      REAL sum = 0;
      for (int a = max(0, b - radius); a <= min(n - 1, b + radius); ++a)
        sum += reflected_weight(taps, radius, n, adjoint ? b : a, adjoint ? a : b) * source[k + (a - b) * inner];
      target[k] = sum;
    }
  }
}
