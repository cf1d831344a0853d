#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, channels, live rows (-1: all)
const Register register_normalise_rows(OpCase{
    .op = "normalise_rows",
    .variations = {{{1, 3, -1}}, {{5, 2, -1}}, {{33, 37, 29}}, {{17, 16, -1}}},
    .inputs = [](const Variation& v, Random& random) -> std::vector<HostTensor> {
      HostTensor x = random.tensor({v.sizes[0], v.sizes[1]}, 0.5, 2);
      for (std::size_t i = 0; i < x.data.size(); i += 3) x.data[i] = -x.data[i];
      x.live_rows = v.sizes[2];
      return {x};
    },
    .reference = [](const Variation& v, const std::vector<HostTensor>& in) -> std::vector<HostTensor> {
      const std::int64_t channels = v.sizes[1], rows = v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2];
      HostTensor y;
      y.shape = in[0].shape;
      for (std::int64_t r = 0; r < rows; ++r) {
        double squares = 1e-12;
        for (std::int64_t c = 0; c < channels; ++c) squares += std::pow(in[0].data[r * channels + c], 2);
        for (std::int64_t c = 0; c < channels; ++c)
          y.data.push_back(in[0].data[r * channels + c] / std::sqrt(squares));
      }
      return {y};
    },
    .benchmark = {{4096, 256, -1}},
    .flops = [](const Variation& v) { return 3.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 8.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
