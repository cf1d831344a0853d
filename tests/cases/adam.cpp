#include <cmath>
#include <limits>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

enum Trouble : std::int64_t {
  none,
  no_status,
  nan_gradient,
  infinite_gradient,
  nan_loss,
  earlier_trouble,
  overflow
};
constexpr double frozen = 255;

// sizes: blocks of 64 parameters, step, trouble
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t blocks = v.sizes[0], elements = 64 * blocks, trouble = v.sizes[2];
  std::vector<HostTensor> in = {random.tensor({elements}), random.tensor({elements}),
                                random.tensor({elements}), random.tensor({elements}, 0, 1)};
  const bool first_step = v.sizes[1] == 1;
  for (int moment : {2, 3})
    if (first_step) in[moment].data.assign(elements, 0.0);
  HostTensor groups{.dtype = DType::u8, .shape = {blocks}, .data = {}};
  for (std::int64_t b = 0; b < blocks; ++b) groups.data.push_back(b % 3 == 2 ? frozen : double(b % 3));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  if (blocks > 2) in[1].data[2 * 64 + 5] = nan;  // frozen: no trouble
  if (trouble == nan_gradient) in[1].data[elements - 1] = nan;
  if (trouble == infinite_gradient) in[1].data[17] = -std::numeric_limits<double>::infinity();
  in.push_back(groups);
  in.push_back({.shape = {2}, .data = {0.1, 0.003}});
  in.push_back({.dtype = DType::i32, .shape = {1}, .data = {double(v.sizes[1])}});
  in.push_back({.dtype = DType::i32, .shape = {3}, .data = {0, 0, 0}, .absent = trouble == no_status});
  if (trouble == earlier_trouble) in[7].data = {1, 4, 99};
  in.push_back({.shape = {1}, .data = {trouble == nan_loss ? nan : 0.5}, .absent = trouble == no_status});
  in.push_back({.dtype = DType::i32,
                .shape = {1},
                .data = {trouble == overflow ? 1.0 : 0.0},
                .absent = trouble != overflow});
  if (trouble == overflow) in[1].data[17] = nan;  // says nothing: the step did not see all of its samples
  for (HostTensor& tensor : in) tensor.differentiable = false;
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor p = in[0], first = in[2], second = in[3], status = in[7];
  const double step = static_cast<double>(v.sizes[1]);
  const std::int64_t elements = p.shape.elements(), trouble = v.sizes[2];
  if (trouble == nan_gradient) status.data = {1, step, static_cast<double>(elements - 1)};
  if (trouble == infinite_gradient) status.data = {1, step, 17};
  if (trouble == nan_loss) status.data = {2, step, -1};
  if (trouble == overflow) status.data = {3, step, -1};
  for (std::int64_t i = 0; i < elements && trouble <= no_status; ++i) {
    const double group = in[4].data[i / 64], g = in[1].data[i];
    if (group == frozen) continue;
    first.data[i] = 0.9 * first.data[i] + 0.1 * g;
    second.data[i] = 0.999 * second.data[i] + 0.001 * g * g;
    const double mean = first.data[i] / (1 - std::pow(0.9, step));
    const double deviation = std::sqrt(second.data[i] / (1 - std::pow(0.999, step)));
    p.data[i] -= in[5].data[static_cast<std::size_t>(group)] * mean / (deviation + 1e-3);
  }
  if (trouble == no_status) return {p, first, second};
  return {p, first, second, status};
}

Variation variation(std::int64_t blocks, std::int64_t step, Trouble trouble) {
  return {{blocks, step, trouble}, {{"beta2", 0.999}, {"epsilon", 1e-3}}};
}

const Register registration(OpCase{
    .op = "adam",
    .variations = {variation(1, 1, no_status), variation(67, 3, none), variation(5, 7, nan_gradient),
                   variation(5, 7, infinite_gradient), variation(5, 1, nan_loss),
                   variation(2, 9, earlier_trouble), variation(2, 4, overflow)},
    .inputs = inputs,
    .reference = reference,
    .benchmark = variation(65536, 5, none),
    .flops = [](const Variation& v) { return 12.0 * 64 * static_cast<double>(v.sizes[0]); },
    .bytes = [](const Variation& v) { return 4.0 * 7 * 64 * static_cast<double>(v.sizes[0]); },
});

}  // namespace
}  // namespace vivant::cases
