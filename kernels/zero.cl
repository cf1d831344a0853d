// zero: fills a tensor of `bytes` bytes with zeros, 64 bytes per work-item.
#include "common.clh"

KERNEL void zero(GLOBAL uchar* restrict x, int bytes) {
  const int i = get_global_id(0) * 64;
  if (i + 64 <= bytes)
    vstore16((uint16)(0), 0, (GLOBAL uint*)(x + i));
  else
    for (int e = i; e < bytes; ++e) x[e] = 0;
}
