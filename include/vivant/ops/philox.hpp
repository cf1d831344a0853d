#pragma once
#include <array>
#include <cstdint>

namespace vivant {

/// Philox4x32-10, a counter-based random generator (Salmon et al., "Parallel random numbers: as easy as 1, 2,
/// 3", 2011): four random words of any counter, with no state. The same words as kernels/philox.clh.
inline std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                           std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t{0xD2511F53} * counter[0],
                        b = std::uint64_t{0xCD9E8D57} * counter[2];
    counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(b),
               static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(a)};
    key[0] += 0x9E3779B9;
    key[1] += 0xBB67AE85;
  }
  return counter;
}

/// Word `index` of the stream that `random_uniform` and its kin draw from: lane index % 4 of the block
/// counter {index / 4, step, 0, 0} under the key {seed, stream}.
inline std::uint32_t random_word(std::uint32_t seed, std::uint32_t step, std::uint32_t stream,
                                 std::uint32_t index) {
  return philox({index / 4, step, 0, 0}, {seed, stream})[index % 4];
}

/// A word as a number in [0, 1): its upper 24 bits, exact as float.
inline double unit_interval(std::uint32_t word) { return static_cast<double>(word >> 8) * 0x1p-24; }

/// A word as an integer in [0, end).
inline std::uint32_t integer_below(std::uint32_t word, std::uint32_t end) {
  return static_cast<std::uint32_t>((std::uint64_t{word} * end) >> 32);
}

}  // namespace vivant
