#include "vivant/ops/philox.hpp"

#include <doctest/doctest.h>

using namespace vivant;

TEST_CASE("philox gives the published known answers") {  // Random123, kat_vectors, philox4x32 10
  using Words = std::array<std::uint32_t, 4>;
  CHECK(philox({0, 0, 0, 0}, {0, 0}) == Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
  const std::uint32_t ones = 0xffffffff;
  CHECK(philox({ones, ones, ones, ones}, {ones, ones}) ==
        Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
  CHECK(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
        Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST_CASE("random integers stay below their end") {
  CHECK(integer_below(0xffffffff, 7) == 6);
  CHECK(integer_below(0, 7) == 0);
  CHECK(unit_interval(0xffffffff) < 1.0);
}
