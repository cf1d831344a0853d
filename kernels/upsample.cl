// upsample: 2x2 blocks of an image of twice the size, and the reverse.
//
//     large [2H, 2W, C]   block of small pixel (i, j):   (0,0) (0,1)
//                                                        (1,0) (1,1)
//   depth_to_space  small [H, W, 4C] -> large   block pixel (u, v) takes the channels (2u + v) C ..
//   space_to_depth  large -> small [H, W, 4C]   the reverse, and its gradient
//   repeat_blocks   small [H, W, C] -> large    every block pixel takes the same channels
//   sum_blocks      large -> small [H, W, C]    its gradient
//   swap_axes       x [A, B, C] -> y [B, A, C]
//
// Work-items: (vectors of channels, x, y) of the output, of the small image for the sums; a work-item takes every n-th
// vector, n the range of axis 0. LANES is 1 for channel counts that are not whole vectors.
#include "lanes.clh"

#define FOR_CHANNELS for (int e = get_global_id(0) * LANES; e < channels; e += get_global_size(0) * LANES)

// The element of channel 0 of the block pixel (row, column) of the large image, in the small one of 4C channels.
inline size_t in_small(int row, int column, int width, int channels) {
  return ((size_t)(row / 2 * width + column / 2) * 4 + row % 2 * 2 + column % 2) * channels;
}

KERNEL void depth_to_space(IN REAL* restrict small, GLOBAL REAL* restrict large, int height, int width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= 2 * width || row >= 2 * height) return;
  const size_t from = in_small(row, column, width, channels), to = (size_t)(row * 2 * width + column) * channels;
  FOR_CHANNELS STORE(LOAD(small + from + e), large + to + e);
}

KERNEL void space_to_depth(IN REAL* restrict large, GLOBAL REAL* restrict small, int height, int width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= 2 * width || row >= 2 * height) return;
  const size_t to = in_small(row, column, width, channels), from = (size_t)(row * 2 * width + column) * channels;
  FOR_CHANNELS STORE(LOAD(large + from + e), small + to + e);
}

KERNEL void repeat_blocks(IN REAL* restrict small, GLOBAL REAL* restrict large, int height, int width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= 2 * width || row >= 2 * height) return;
  const size_t from = (size_t)(row / 2 * width + column / 2) * channels;
  const size_t to = (size_t)(row * 2 * width + column) * channels;
  FOR_CHANNELS STORE(LOAD(small + from + e), large + to + e);
}

KERNEL void sum_blocks(IN REAL* restrict large, GLOBAL REAL* restrict small, int height, int width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);
  if (column >= width || row >= height) return;
  IN REAL* upper = large + (size_t)(4 * row * width + 2 * column) * channels;
  IN REAL* lower = upper + (size_t)2 * width * channels;
  GLOBAL REAL* out = small + (size_t)(row * width + column) * channels;
  FOR_CHANNELS STORE(LOAD(upper + e) + LOAD(upper + channels + e) + LOAD(lower + e) + LOAD(lower + channels + e),
                     out + e);
}

KERNEL void swap_axes(IN REAL* restrict x, GLOBAL REAL* restrict y, int height, int width, int channels) {
  const int column = get_global_id(1), row = get_global_id(2);  // of x
  if (column >= width || row >= height) return;
  IN REAL* in = x + (size_t)(row * width + column) * channels;
  GLOBAL REAL* out = y + (size_t)(column * height + row) * channels;
  FOR_CHANNELS STORE(LOAD(in + e), out + e);
}
