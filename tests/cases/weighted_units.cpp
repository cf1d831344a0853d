#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rays, samples, channels, units, 1 when every ray has a term of its own, 1 when x holds only the
// samples that weigh something

double threshold_of(const Variation& v) { return v.attributes.value("threshold", 0.0); }

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t rays = v.sizes[0], samples = v.sizes[1], channels = v.sizes[2], units = v.sizes[3];
  HostTensor weight = random.tensor({rays, samples}, 0.1, 1);
  // Some far below the threshold, all of ray 1; central differences must not cross it.
  if (threshold_of(v) > 0) {
    for (std::size_t i = 2; i < weight.data.size(); i += 3) weight.data[i] = 0;
    for (std::int64_t i = samples; i < 2 * samples; ++i) weight.data[i] = 0.01;
  }
  HostTensor rows = fixed_tensor(DType::i32, {rays, samples});
  rows.absent = v.sizes[5] == 0;
  double row = 0;
  for (const double heaviness : weight.data) rows.data.push_back(heaviness < threshold_of(v) ? -1 : row++);
  const std::int64_t count = rows.absent ? rays * samples : static_cast<std::int64_t>(row);
  std::vector<HostTensor> in = {weight, random.tensor({count, channels}), random.tensor({channels, units}),
                                random.tensor(v.sizes[4] ? Shape{rays, units} : Shape{units}), rows};
  if (!rows.absent) in[0].differentiable = in[1].differentiable = false;
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t rays = v.sizes[0], samples = v.sizes[1], channels = v.sizes[2], units = v.sizes[3];
  HostTensor y;
  y.shape = {rays, units};
  y.data.resize(rays * units);
  for (std::int64_t i = 0; i < rays * samples; ++i) {
    if (in[0].data[i] < threshold_of(v)) continue;
    const auto row = in[4].absent ? i : static_cast<std::int64_t>(in[4].data[i]);
    for (std::int64_t j = 0; j < units; ++j) {
      double unit = in[3].data[v.sizes[4] ? i / samples * units + j : j];
      for (std::int64_t k = 0; k < channels; ++k)
        unit += in[1].data[row * channels + k] * in[2].data[k * units + j];
      if (unit > 0) y.data[i / samples * units + j] += in[0].data[i] * unit;
    }
  }
  return {y};
}

double products(const Variation& v) {
  return static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2] * v.sizes[3]);
}

const Register registration(OpCase{
    .op = "weighted_units",
    .variations = {{{1, 1, 1, 1, 0, 0}},
                   {{3, 29, 5, 7, 1, 0}, {{"threshold", 0.05}}},
                   {{11, 13, 16, 48, 0, 0}, {{"threshold", 0.05}}},
                   {{9, 7, 32, 128, 1, 0}},
                   {{7, 11, 16, 40, 1, 1}, {{"threshold", 0.05}}},
                   {{12, 9, 35, 128, 0, 1}, {{"threshold", 0.05}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{2048, 96, 16, 128, 1, 0}},
    .flops = [](const Variation& v) { return 2 * products(v); },
    .bytes =
        [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]); },
});

}  // namespace
}  // namespace vivant::cases
