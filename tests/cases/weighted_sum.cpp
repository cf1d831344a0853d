#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rays, samples, channels, every how manyth sample has a row (0: all, without ids), rows too many

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t rays = v.sizes[0], samples = v.sizes[1], channels = v.sizes[2], every = v.sizes[3];
  std::vector<HostTensor> in = {random.tensor({rays, samples}, 0, 1)};
  HostTensor ids;
  ids.dtype = DType::i32;
  ids.absent = every == 0;
  for (std::int64_t i = 0; every > 0 && i < rays * samples; ++i)
    if (i % every == 0 && i / samples != 1) ids.data.push_back(static_cast<double>(i));  // none for ray 1
  const auto live = static_cast<std::int64_t>(ids.data.size());
  const std::int64_t rows = every == 0 ? rays * samples : live + v.sizes[4];
  ids.data.resize(rows, -7);
  ids.shape = {rows};
  in.push_back(random.tensor({rows, channels}));
  if (every > 0) in[1].live_rows = live;
  for (std::size_t i = 3; i < in[0].data.size(); i += 7) in[0].data[i] = 0;
  in.push_back(ids);
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t samples = v.sizes[1], channels = v.sizes[2];
  const std::int64_t rows = in[1].live_rows < 0 ? in[1].shape[0] : in[1].live_rows;
  HostTensor y;
  y.shape = {v.sizes[0], channels};
  y.data.resize(v.sizes[0] * channels);
  for (std::int64_t k = 0; k < rows; ++k) {
    const std::int64_t sample = in[2].absent ? k : static_cast<std::int64_t>(in[2].data[k]);
    for (std::int64_t c = 0; c < channels; ++c)
      y.data[sample / samples * channels + c] += in[0].data[sample] * in[1].data[k * channels + c];
  }
  return {y};
}

const Register registration(OpCase{
    .op = "weighted_sum",
    .variations = {{{1, 1, 3, 0, 0}}, {{13, 65, 32, 0, 0}}, {{9, 11, 32, 3, 5}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16384, 128, 128, 0, 0}},
    .flops =
        [](const Variation& v) { return 2.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]); },
    .bytes =
        [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]); },
});

}  // namespace
}  // namespace vivant::cases
