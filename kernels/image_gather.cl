// image_gather: y [R,C] = images u8 [pixels,C] at pixel ids, divided by 255. One pixel per work-item.
#include "common.clh"

KERNEL void image_gather(IN uchar* restrict images, IN int* restrict pixels, GLOBAL REAL* restrict y, int capacity,
                         int channels, IN int* count) {
  const int ray = get_global_id(0);
  if (ray >= live_rows(capacity, count)) return;
  const int pixel = pixels[ray];
  for (int c = 0; c < channels; ++c)
    y[(size_t)ray * channels + c] = pixel < 0 ? 0 : images[(size_t)pixel * channels + c] / (REAL)255;
}
