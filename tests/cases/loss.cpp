#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, channels, live rows (-1: all), weighted
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const Shape shape = {v.sizes[0], v.sizes[1]};
  std::vector<HostTensor> in = {random.tensor(shape), random.tensor(shape),
                                random.tensor({v.sizes[0], 1}, 0, 2)};
  in[0].live_rows = in[1].live_rows = v.sizes[2];
  in[2].absent = v.sizes[3] == 0;
  in[2].differentiable = false;
  return in;
}

std::int64_t live_elements(const Variation& v) {
  return (v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2]) * v.sizes[1];
}

OpCase difference_case(const std::string& op, double (*term)(double), std::vector<Variation> variations) {
  return {
      .op = op,
      .variations = std::move(variations),
      .inputs = inputs,
      .reference =
          [term](const Variation& v, const std::vector<HostTensor>& in) {
            double sum = 0;
            for (std::int64_t i = 0; i < live_elements(v); ++i)
              sum += (v.sizes[3] ? in[2].data[i / v.sizes[1]] : 1) * term(in[0].data[i] - in[1].data[i]);
            return std::vector<HostTensor>{
                {.shape = {1}, .data = {sum / std::max<double>(1, static_cast<double>(live_elements(v)))}}};
          },
      .benchmark = {{36864, 256, -1, 0}},
      .flops = [](const Variation& v) { return 3.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
      .bytes = [](const Variation& v) { return 8.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); }};
}

const Register register_l1(difference_case("l1_loss", [](double d) { return std::abs(d); },
                                           {{{1, 1, -1, 0}}, {{211, 7, 150, 0}}, {{211, 3, 101, 1}}}));
const Register register_l2(difference_case("l2_loss", [](double d) { return d * d; },
                                           {{{97, 17, -1, 0}}, {{211, 3, -1, 1}}, {{5, 40, 0, 0}}}));

const Register register_hard(OpCase{
    .op = "hard_loss",
    .variations = {{{65, 17, -1}}, {{91, 5, 70}}},
    .inputs =
        [](const Variation& v, Random& random) {
          std::vector<HostTensor> in = {random.tensor({v.sizes[0], v.sizes[1]}, -0.5, 1.5)};
          in[0].live_rows = v.sizes[2];
          return in;
        },
    .reference =
        [](const Variation& v, const std::vector<HostTensor>& in) {
          double sum = 0;
          for (std::int64_t i = 0; i < live_elements(v); ++i) {
            const double w = in[0].data[i];
            sum +=
                std::log(1 + std::exp(-1.0)) - std::log(std::exp(-std::abs(w)) + std::exp(-std::abs(1 - w)));
          }
          return std::vector<HostTensor>{
              {.shape = {1}, .data = {sum / static_cast<double>(live_elements(v))}}};
        },
    .benchmark = {{524288, 1, -1}},
    .flops = [](const Variation& v) { return 10.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 4.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
