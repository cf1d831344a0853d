#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows of x, channels, live rows (-1: all), rows of y. The ids ascend, with a hole where 1 in 5 rows
// is left out.
std::vector<HostTensor> place_inputs(const Variation& v, Random& random) {
  const std::int64_t n = v.sizes[0], stride = v.sizes[3] / n;
  std::vector<HostTensor> in = {random.tensor({n, v.sizes[1]}), random.tensor({n})};
  in[0].live_rows = v.sizes[2];
  in[1].dtype = DType::i32;
  for (std::int64_t i = 0; i < n; ++i)
    in[1].data[i] = static_cast<double>(i % 5 == 3 ? -1 : i * stride + random.integer(stride));
  return in;
}

std::vector<HostTensor> place_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t channels = v.sizes[1], live = v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2];
  HostTensor y;
  y.shape = {v.sizes[3], channels};
  y.data.assign(v.sizes[3] * channels, 0.0);
  for (std::int64_t i = 0; i < live; ++i)
    for (std::int64_t c = 0; c < channels && in[1].data[i] >= 0; ++c)
      y.data[static_cast<std::int64_t>(in[1].data[i]) * channels + c] = in[0].data[i * channels + c];
  return {y};
}

const Register place(OpCase{
    .op = "place_rows",
    .variations = {{{1, 1, -1, 1}, {{"rows", 1}}},
                   {{71, 1, 50, 331}, {{"rows", 331}}},
                   {{130, 5, -1, 130}, {{"rows", 130}}}},
    .inputs = place_inputs,
    .reference = place_reference,
    .benchmark = {{65536, 1, -1, 131072}, {{"rows", 131072}}},
    .bytes =
        [](const Variation& v) {
          return 4.0 * static_cast<double>(v.sizes[1] * (2 * v.sizes[0] + v.sizes[3]));
        },
});

}  // namespace
}  // namespace vivant::cases
