#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: taps, K, N, live rows of a single tap (-1: all)
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t taps = v.sizes[0], k = v.sizes[1], n = v.sizes[2];
  HostTensor w = random.tensor(taps == 1 ? Shape{k, n} : Shape{taps, k, n});
  w.live_rows = v.sizes[3];
  w.differentiable = false;  // a layout: the ops that read it have gradients of their own
  return {w};
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const bool transposed = v.attributes.value("transposed", false);
  const std::int64_t taps = v.sizes[0], panel = v.attributes.at("panel"), live = v.sizes[3];
  const std::int64_t rows = transposed ? v.sizes[2] : v.sizes[1],
                     columns = transposed ? v.sizes[1] : v.sizes[2];
  const auto weight = [&](std::int64_t tap, std::int64_t row, std::int64_t column) {
    if (column >= columns) return 0.0;
    const std::int64_t k = transposed ? column : row, n = transposed ? row : column;
    if (live >= 0 && k >= live) return 0.0;
    return in[0].data[((transposed ? taps - 1 - tap : tap) * v.sizes[1] + k) * v.sizes[2] + n];
  };
  HostTensor packed;
  const std::int64_t padded = rows < 16 ? rows : (rows + 31) / 32 * 32;
  packed.shape = {(columns + panel - 1) / panel, taps * padded, panel};
  for (std::int64_t p = 0; p < packed.shape[0]; ++p) {
    for (std::int64_t tap = 0; tap < taps; ++tap)
      for (std::int64_t row = 0; row < rows; ++row)
        for (std::int64_t c = 0; c < panel; ++c) packed.data.push_back(weight(tap, row, p * panel + c));
    packed.data.resize((p + 1) * taps * padded * panel, 0.0);
  }
  return {packed};
}

const Register register_pack_weights(OpCase{
    .op = "pack_weights",
    .variations = {{{1, 1, 1, -1}, {{"panel", 16}}},
                   {{9, 7, 33, -1}, {{"panel", 16}}},
                   {{1, 19, 31, 17}, {{"panel", 32}}},
                   {{9, 17, 5, -1}, {{"panel", 16}, {"transposed", true}}},
                   {{1, 35, 13, 18}, {{"panel", 16}, {"transposed", true}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{9, 512, 512, -1}, {{"panel", 32}}},
    .bytes =
        [](const Variation& v) { return 8.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]); },
});

}  // namespace
}  // namespace vivant::cases
