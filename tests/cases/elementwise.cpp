#include <algorithm>
#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

/// Values in [-3, 3] that keep away from the kink of relu at 0.
HostTensor away_from_zero(Random& random, Shape shape) {
  HostTensor x = random.tensor(std::move(shape), -3, 3);
  for (double& value : x.data) value += value < 0 ? -0.01 : 0.01;
  return x;
}

// sizes: rows, channels, live rows (-1: all)
std::vector<HostTensor> one_input(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {away_from_zero(random, {v.sizes[0], v.sizes[1]})};
  in[0].live_rows = v.sizes[2];
  return in;
}

std::int64_t live_elements(const Variation& v) {
  return (v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2]) * v.sizes[1];
}

std::vector<HostTensor> map(const Variation& v, const HostTensor& x,
                            const std::function<double(double)>& function) {
  HostTensor y;
  y.shape = x.shape;
  for (std::int64_t i = 0; i < live_elements(v); ++i) y.data.push_back(function(x.data[i]));
  return {y};
}

std::vector<HostTensor> activation_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::string name = v.attributes.at("function");
  return map(v, in[0], [&](double x) {
    if (name == "relu") return std::max(x, 0.0);
    if (name == "leaky_relu") return x > 0 ? x : 0.01 * x;
    if (name == "softplus") return std::log1p(std::exp(x));
    if (name == "sigmoid") return 1 / (1 + std::exp(-x));
    return std::exp(std::min(x, 12.0));
  });
}

const auto activation_bytes = [](const Variation& v) {
  return 8.0 * static_cast<double>(v.sizes[0] * v.sizes[1]);
};

const Register register_activation(OpCase{
    .op = "activation",
    .variations = {{{150, 3, 101}, {{"function", "relu"}}},
                   {{7, 13, -1}, {{"function", "relu"}}},
                   {{17, 16, -1}, {{"function", "leaky_relu"}}},
                   {{5, 33, -1}, {{"function", "softplus"}}},
                   {{5, 33, -1}, {{"function", "sigmoid"}}},
                   {{1, 35, -1}, {{"function", "truncated_exp"}}}},
    .inputs = one_input,
    .reference = activation_reference,
    .benchmark = {{196608, 128, -1}, {{"function", "softplus"}}},
    .bytes = activation_bytes,
});

const Register register_affine(OpCase{
    .op = "affine",
    .variations = {{{1, 1, -1}, {{"scale", -2.5}, {"shift", 0.75}}},
                   {{70, 5, 0}, {{"scale", 0.5}}},
                   {{37, 19, 20}, {{"scale", 3.0}, {"shift", -1.0}}}},
    .inputs = one_input,
    .reference =
        [](const Variation& v, const std::vector<HostTensor>& in) {
          const double scale = v.attributes.at("scale"), shift = v.attributes.value("shift", 0.0);
          return map(v, in[0], [=](double x) { return scale * x + shift; });
        },
    .benchmark = {{196608, 128, -1}, {{"scale", 2.0}}},
    .bytes = activation_bytes,
});

const Register register_clamp(OpCase{
    .op = "clamp",
    .variations = {{{7, 13, -1}, {{"low", -0.5}, {"high", 1.25}}}, {{37, 19, 20}, {{"low", 0.0}}}},
    .inputs = one_input,
    .reference =
        [](const Variation& v, const std::vector<HostTensor>& in) {
          const double low = v.attributes.at("low"), high = v.attributes.value("high", 1.0);
          return map(v, in[0], [=](double x) { return std::clamp(x, low, high); });
        },
    .benchmark = {{196608, 128, -1}},
    .bytes = activation_bytes,
});

// sizes: rows, channels, live rows (-1: all), rows and channels of b (0 rows: the shape [channels])
std::vector<HostTensor> two_inputs(const Variation& v, Random& random) {
  const auto& s = v.sizes;
  std::vector<HostTensor> in = one_input(v, random);
  in.push_back(away_from_zero(random, s[3] == 0 ? Shape{s[4]} : Shape{s[3], s[4]}));
  if (s[3] == s[0]) in[1].live_rows = s[2];
  return in;
}

OpCase binary_case(const std::string& op, double (*function)(double, double),
                   std::vector<Variation> variations) {
  return {
      .op = op,
      .variations = std::move(variations),
      .inputs = two_inputs,
      .reference =
          [function](const Variation& v, const std::vector<HostTensor>& in) {
            const std::int64_t channels = v.sizes[1], b_rows = std::max<std::int64_t>(1, v.sizes[3]);
            HostTensor y;
            y.shape = in[0].shape;
            for (std::int64_t i = 0; i < live_elements(v); ++i) {
              const std::int64_t row = b_rows == 1 ? 0 : i / channels;
              const std::int64_t column = v.sizes[4] == 1 ? 0 : i % channels;
              y.data.push_back(function(in[0].data[i], in[1].data[row * v.sizes[4] + column]));
            }
            return std::vector<HostTensor>{y};
          },
      .benchmark = {{196608, 128, -1, 196608, 128}},
      .bytes = [](const Variation& v) { return 12.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
  };
}

const Register register_add(binary_case("add", [](double a, double b) { return a + b; },
                                        {{{7, 13, -1, 7, 13}}, {{90, 5, 70, 90, 5}}, {{11, 18, -1, 0, 18}}}));
const Register register_subtract(
    binary_case("subtract", [](double a, double b) { return a - b; },
                {{{7, 13, -1, 7, 13}}, {{33, 17, -1, 33, 1}}, {{21, 4, 3, 0, 1}}}));
const Register register_multiply(binary_case("multiply", [](double a, double b) { return a * b; },
                                             {{{17, 16, -1, 17, 16}},
                                              {{90, 5, 70, 90, 5}},
                                              {{40, 6, 33, 0, 6}},
                                              {{40, 6, 33, 40, 1}},
                                              {{19, 3, -1, 0, 1}}}));

}  // namespace
}  // namespace vivant::cases
