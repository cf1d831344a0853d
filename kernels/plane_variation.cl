// plane_variation: the squared differences of neighbouring cells, and their gradient. A work-item takes a row of a plane
// as one run of width * channels numbers: the cell to the left is `channels` numbers back, the cell above a row back.
//   planes [P,H,W,C]  ->  partial [P * H], the sums of the rows  ->  y [1] = scale * sum
//
//          above
//            |
//     left - p - right        d y / d p = 2 scale (4 p - above - below - left - right), less those that are missing
//            |
//          below
#include "common.clh"

KERNEL void plane_variation_rows(IN REAL* restrict planes, GLOBAL REAL* restrict partial, int rows, int height,
                                 int width, int channels) {
  const int row = get_global_id(0), length = width * channels;
  if (row >= rows) return;
  IN REAL* here = planes + (size_t)row * length;
  const bool below = row % height < height - 1;
  REALV sum = (REALV)(0);
  REAL lanes[VW], total = 0;
  int e = 0;
  for (; e + VW <= length - channels; e += VW) {
    const REALV p = VLOAD(0, here + e), right = VLOAD(0, here + e + channels) - p;
    sum += right * right;
    if (below) {
      const REALV down = VLOAD(0, here + e + length) - p;
      sum += down * down;
    }
  }
  VSTORE(sum, 0, lanes);
  for (int k = 0; k < VW; ++k) total += lanes[k];
  for (; e < length; ++e) {
    const REAL right = e < length - channels ? here[e + channels] - here[e] : 0;
    const REAL down = below ? here[e + length] - here[e] : 0;
    total += right * right + down * down;
  }
  partial[row] = total;
}

KERNEL void plane_variation_sum(IN REAL* restrict partial, GLOBAL REAL* restrict y, int rows, REAL scale) {
  if (get_global_id(0) > 0) return;
  REAL total = 0;
  for (int row = 0; row < rows; ++row) total += partial[row];
  y[0] = scale * total;
}

KERNEL void plane_variation_gradient(IN REAL* restrict planes, IN REAL* restrict grad_y, GLOBAL REAL* restrict grad_x,
                                     int rows, int height, int width, int channels, REAL scale) {
  const int row = get_global_id(0), length = width * channels;
  if (row >= rows) return;
  IN REAL* here = planes + (size_t)row * length;
  GLOBAL REAL* grad = grad_x + (size_t)row * length;
  const REAL factor = 2 * scale * grad_y[0];
  // A missing neighbour is the cell itself.
  const int above = row % height > 0 ? -length : 0, below = row % height < height - 1 ? length : 0;
  for (int e = 0; e < length;) {
    const bool left = e >= channels, right = e < length - channels;
    if (left && e + VW <= length - channels) {
      IN REAL* p = here + e;
      const REALV others = VLOAD(0, p + above) + VLOAD(0, p + below) + VLOAD(0, p - channels) + VLOAD(0, p + channels);
      VSTORE(factor * (4 * VLOAD(0, p) - others), 0, grad + e);
      e += VW;
    } else {
      const REAL others = here[e + above] + here[e + below] + here[left ? e - channels : e] + here[right ? e + channels : e];
      grad[e] = factor * (4 * here[e] - others);
      ++e;
    }
  }
}
