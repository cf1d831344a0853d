#include <algorithm>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, channels, live rows (-1: all)
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], v.sizes[1]}, -1, 2)};
  in[0].live_rows = v.sizes[2];
  return in;
}

/// Adds every live element to the element of y that `target` names by row and channel.
HostTensor add_up(const Variation& v, const HostTensor& x, Shape shape, std::int64_t elements,
                  const std::function<std::int64_t(std::int64_t, std::int64_t)>& target) {
  HostTensor y;
  y.shape = std::move(shape);
  y.data.assign(elements, 0.0);
  const std::int64_t rows = v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2], channels = v.sizes[1];
  for (std::int64_t r = 0; r < rows; ++r)
    for (std::int64_t c = 0; c < channels; ++c) y.data[target(r, c)] += x.data[r * channels + c];
  return y;
}

OpCase reduction_case(
    const std::string& op, std::vector<Variation> variations,
    std::function<std::vector<HostTensor>(const Variation&, const std::vector<HostTensor>&)> reference) {
  return {.op = op,
          .variations = std::move(variations),
          .inputs = inputs,
          .reference = std::move(reference),
          .benchmark = {{196608, 128, -1}},
          .flops = [](const Variation& v) { return static_cast<double>(v.sizes[0] * v.sizes[1]); },
          .bytes = [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); }};
}

const Register register_sum_rows(
    reduction_case("sum_rows", {{{1, 1, -1}}, {{513, 17, -1}}, {{1100, 3, 700}}, {{9, 40, 0}}},
                   [](const Variation& v, const std::vector<HostTensor>& in) {
                     return std::vector<HostTensor>{add_up(v, in[0], {v.sizes[1]}, v.sizes[1],
                                                           [](std::int64_t, std::int64_t c) { return c; })};
                   }));

const Register register_sum_channels(
    reduction_case("sum_channels", {{{65, 19, -1}}, {{70, 1, 5}}},
                   [](const Variation& v, const std::vector<HostTensor>& in) {
                     const std::int64_t rows = v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2];
                     return std::vector<HostTensor>{add_up(v, in[0], {v.sizes[0], 1}, rows,
                                                           [](std::int64_t r, std::int64_t) { return r; })};
                   }));

const Register register_sum(reduction_case("sum", {{{1, 1, -1}}, {{333, 7, -1}}, {{90, 20, 61}}},
                                           [](const Variation& v, const std::vector<HostTensor>& in) {
                                             return std::vector<HostTensor>{
                                                 add_up(v, in[0], {1}, 1,
                                                        [](std::int64_t, std::int64_t) { return 0; })};
                                           }));

// Every run has rows / groups rows; its gradient repeats them.
const Register register_sum_groups(OpCase{
    .op = "sum_groups",
    .variations = {{{1, 1, -1}, {{"groups", 1}}},
                   {{91, 19, -1}, {{"groups", 13}}},
                   {{34, 16, -1}, {{"groups", 17}}},
                   {{5, 3, -1}, {{"groups", 5}}}},
    .inputs = inputs,
    .reference = [](const Variation& v, const std::vector<HostTensor>& in) -> std::vector<HostTensor> {
      const std::int64_t groups = v.attributes.at("groups"), run = v.sizes[0] / groups, channels = v.sizes[1];
      return {add_up(v, in[0], {groups, channels}, groups * channels,
                     [=](std::int64_t r, std::int64_t c) { return r / run * channels + c; })};
    },
    .benchmark = {{196608, 128, -1}, {{"groups", 2048}}},
    .flops = [](const Variation& v) { return static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

const Register register_mean(
    reduction_case("mean", {{{333, 7, -1}}}, [](const Variation& v, const std::vector<HostTensor>& in) {
      HostTensor y = add_up(v, in[0], {1}, 1, [](std::int64_t, std::int64_t) { return 0; });
      y.data[0] /= static_cast<double>(v.sizes[0] * v.sizes[1]);
      return std::vector<HostTensor>{y};
    }));

}  // namespace
}  // namespace vivant::cases
