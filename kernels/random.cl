// random: four numbers per work-item, from the block of its own index.
#include "philox.clh"

KERNEL void random_uniform(IN int* seed, IN int* step, GLOBAL REAL* restrict y, int stream, int elements) {
  const int block = get_global_id(0);
  uint words[4];
  philox(block, step[0], seed[0], stream, words);
  for (int k = 0; k < min(4, elements - 4 * block); ++k) y[4 * block + k] = unit_interval(words[k]);
}

// Integers in [0, end), or, with a list, the entries of these numbers.
KERNEL void random_integers(IN int* seed, IN int* step, IN int* list, GLOBAL int* restrict y, int stream, int elements,
                            int end) {
  const int block = get_global_id(0);
  uint words[4];
  philox(block, step[0], seed[0], stream, words);
  for (int k = 0; k < min(4, elements - 4 * block); ++k) {
    const int number = mul_hi(words[k], (uint)end);
    y[4 * block + k] = list ? list[number] : number;
  }
}
