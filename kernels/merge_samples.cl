// merge_samples: two fields' samples on the same rays in one order, by depth. One work-item per ray.
//   merge_order    depths_a [R, A], depths_b [R, B], each ascending -> order [R, A + B]: indices into (a, b), ties a first
//   merge_by       a [R, A], b [R, B] -> merged [R, A + B]
//   split_by       merged [R, A + B] -> a [R, A], b [R, B], the inverse
//   union_deltas   intervals recomputed over the union of the samples; those of length 0 stay empty
#include "common.clh"

KERNEL void merge_order(IN REAL* restrict depths_a, IN REAL* restrict depths_b, GLOBAL int* restrict order, int rays,
                        int a_count, int b_count) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  IN REAL* a = depths_a + (size_t)ray * a_count;
  IN REAL* b = depths_b + (size_t)ray * b_count;
  GLOBAL int* out = order + (size_t)ray * (a_count + b_count);
  int i = 0, j = 0;
  for (int k = 0; k < a_count + b_count; ++k) {
    const bool take_a = j >= b_count || (i < a_count && a[i] <= b[j]);
    out[k] = take_a ? i++ : a_count + j++;
  }
}

KERNEL void merge_by(IN int* restrict order, IN REAL* restrict a, IN REAL* restrict b, GLOBAL REAL* restrict merged,
                     int rays, int a_count, int b_count) {
  const int ray = get_global_id(0), total = a_count + b_count;
  if (ray >= rays) return;
  for (int k = 0; k < total; ++k) {
    const int from = order[(size_t)ray * total + k];
    merged[(size_t)ray * total + k] =
        from < a_count ? a[(size_t)ray * a_count + from] : b[(size_t)ray * b_count + from - a_count];
  }
}

KERNEL void split_by(IN int* restrict order, IN REAL* restrict merged, GLOBAL REAL* restrict a,
                     GLOBAL REAL* restrict b, int rays, int a_count, int b_count) {
  const int ray = get_global_id(0), total = a_count + b_count;
  if (ray >= rays) return;
  for (int k = 0; k < total; ++k) {
    const int to = order[(size_t)ray * total + k];
    const REAL value = merged[(size_t)ray * total + k];
    if (to < a_count)
      a[(size_t)ray * a_count + to] = value;
    else
      b[(size_t)ray * b_count + to - a_count] = value;
  }
}

KERNEL void union_deltas(IN REAL* restrict depths, IN REAL* restrict deltas, GLOBAL REAL* restrict out, int rays,
                         int samples) {
  const int ray = get_global_id(0);
  if (ray >= rays) return;
  int next = -1;  // the nearest sample behind this one that is not empty
  for (int k = samples - 1; k >= 0; --k) {
    const size_t at = (size_t)ray * samples + k;
    const REAL own = deltas[at];
    out[at] = own == 0 || next < 0 ? own : depths[(size_t)ray * samples + next] - depths[at];
    if (own != 0) next = k;
  }
}
