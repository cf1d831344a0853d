// check_units: wrong [1] = how many elements of a . w are wrong by the matrix units (matrix_units.clh), all else being
// small integers, which are exact: two segments, added to what is there, 32 and 16 columns. One work-item.
#include "matrix_units.clh"

#if MATRIX_UNITS
#define SEGMENTS 2
#define PAIRS 32
#define COLUMNS 48

// bf16 of an integer from -8 to 7.
INLINE uint small_integer(int seed) { return as_uint((float)((seed * 7 + seed / 5) % 16 - 8)) >> 16; }

KERNEL void check_units(GLOBAL int* restrict wrong) {
  uint a[2 * SEGMENTS * 32 * PAIRS] ALIGNED, w[2 * SEGMENTS * PAIRS * COLUMNS] ALIGNED;
  float c[32 * 64] ALIGNED;
  const int a_part = SEGMENTS * 32 * PAIRS, w_part = SEGMENTS * PAIRS * COLUMNS;
  for (int i = 0; i < 2 * a_part; ++i) a[i] = small_integer(2 * i) | small_integer(2 * i + 1) << 16;
  for (int i = 0; i < 2 * w_part; ++i) w[i] = small_integer(3 * i + 1) | small_integer(5 * i) << 16;
  for (int i = 0; i < 32 * 64; ++i) c[i] = i % 13;
  // Part of a goes through the conversion that rows take.
  float row[2 * PAIRS] ALIGNED;
  for (int i = 0; i < 2 * PAIRS; ++i) row[i] = i % 15 - 7;
  stage_buffer(row, 0, 2 * PAIRS, 32, a, PAIRS, a_part, 3);
  BEGIN_UNITS
  product(PASS_REGISTERS OPERAND(a, 4 * PAIRS, 4 * a_part, 4 * 32 * PAIRS, 0), 64 * PAIRS,
          OPERAND(w, 4 * COLUMNS, 4 * w_part, 4 * PAIRS * COLUMNS, 0), COLUMNS, PAIRS, SEGMENTS, SEGMENTS, 3, c, 64, 1);
  END_UNITS
  int count = 0;
  for (int k = 0; k < 2 * PAIRS; ++k)
    if (as_float(((a[k / 2] >> (k % 2 * 16)) & 0xffff) << 16) != row[k]) ++count;
  for (int r = 0; r < 32; ++r)
    for (int j = 0; j < COLUMNS; ++j) {
      float sum = (r * 64 + j) % 13;
      for (int part = 0; part < 3; ++part)
        for (int s = 0; s < SEGMENTS; ++s)
          for (int k = 0; k < PAIRS; ++k) {
            const uint x = a[(part == 2) * a_part + (s * 32 + r) * PAIRS + k];
            const uint y = w[(part == 1) * w_part + (s * PAIRS + k) * COLUMNS + j];
            sum += as_float(x << 16) * as_float(y << 16) + as_float(x & 0xffff0000) * as_float(y & 0xffff0000);
          }
      if (sum != c[r * 64 + j]) ++count;
    }
  wrong[0] = count;
}
#endif
