#include "cases/op_case.hpp"
#include "vivant/ops/philox.hpp"

namespace vivant::cases {
namespace {

// sizes: rays
constexpr std::uint32_t seed = 17, step = 900;

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], 1}, 0.1, 2),
                                random.tensor({v.sizes[0], 1}, 2.5, 9)};
  if (v.sizes[0] > 3) in[0].data[3] = in[1].data[3] = 0;  // a miss
  for (const std::uint32_t number : {seed, step}) {
    HostTensor scalar;
    scalar.dtype = DType::i32;
    scalar.shape = {1};
    scalar.data = {static_cast<double>(number)};
    in.push_back(scalar);
  }
  in[0].differentiable = in[1].differentiable = false;
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t rays = v.sizes[0], samples = v.attributes["samples"], blocks = (samples + 3) / 4;
  const bool disparity = v.attributes.value("spacing", "linear") == "disparity";
  HostTensor depths, deltas;
  depths.shape = deltas.shape = {rays, samples};
  for (std::int64_t r = 0; r < rays; ++r) {
    const double near = in[0].data[r], far = in[1].data[r];
    for (std::int64_t s = 0; s < samples; ++s) {
      const auto index = static_cast<std::uint32_t>(r * blocks * 4 + s);
      const double place =
          v.attributes.value("jitter", true)
              ? unit_interval(random_word(seed, step, v.attributes.value("stream", 0u), index))
              : 0.5;
      const double f = (static_cast<double>(s) + place) / static_cast<double>(samples);
      const bool miss = near == 0 && far == 0;
      depths.data.push_back(miss ? 0 : disparity ? 1 / ((1 - f) / near + f / far) : near + f * (far - near));
    }
    for (std::int64_t i = r * samples; i < (r + 1) * samples; ++i)
      deltas.data.push_back((i + 1 == (r + 1) * samples ? far : depths.data[i + 1]) - depths.data[i]);
  }
  return {depths, deltas};
}

const Register registration(OpCase{
    .op = "stratified_samples",
    .variations = {{{1}, {{"samples", 1}}},
                   {{17}, {{"samples", 13}, {"stream", 3}}},
                   {{9}, {{"samples", 16}, {"spacing", "disparity"}, {"stream", 2}}},
                   {{5}, {{"samples", 6}, {"spacing", "disparity"}, {"jitter", false}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16384}, {{"samples", 128}}},
    .bytes = [](const Variation& v) { return 8.0 * 128 * static_cast<double>(v.sizes[0]); },
});

}  // namespace
}  // namespace vivant::cases
