// concat: copies a range of columns between two matrices; concat and slice are made of it.
//
//   to[row][to_first + c] = from[row][from_first + c],  c < width;  one vector of VW columns per work-item
#include "common.clh"

KERNEL void copy_columns(IN REAL* restrict from, GLOBAL REAL* restrict to, int rows, int from_columns, int from_first,
                         int to_columns, int to_first, int width, IN int* count) {
  const int c = get_global_id(0) * VW, row = get_global_id(1);
  if (row >= live_rows(rows, count)) return;
  IN REAL* source = from + (size_t)row * from_columns + from_first;
  GLOBAL REAL* target = to + (size_t)row * to_columns + to_first;
  if (c + VW <= width) {
    VSTORE(VLOAD(0, source + c), 0, target + c);
  } else {
    for (int e = c; e < width; ++e) target[e] = source[e];
  }
}
