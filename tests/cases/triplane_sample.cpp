#include <algorithm>
#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: points, H, W, C, live points (-1: all), coherent points along rays (0 or 1)

/// A coordinate whose distance from the kinks of the sampling (pixel centres) is at least a hundredth of a
/// pixel on both axes.
double smooth_coordinate(std::int64_t height, std::int64_t width, Random& random) {
  while (true) {
    const double x = random.uniform(-1.05, 1.05);
    const auto near_kink = [&](std::int64_t extent) {
      const double u = (x + 1) / 2 * static_cast<double>(extent) - 0.5;
      return std::abs(u - std::round(u)) < 0.01;
    };
    if (!near_kink(height) && !near_kink(width)) return x;
  }
}

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const auto& s = v.sizes;
  std::vector<HostTensor> in = {random.tensor({3, s[1], s[2], s[3]}, 0.2, 1.5), random.tensor({s[0], 3})};
  std::vector<double>& points = in[1].data;
  if (s[5] == 0)
    for (double& x : points) x = smooth_coordinate(s[1], s[2], random);
  else
    for (std::int64_t i = 0; i < s[0]; ++i) {  // rays of 128 samples through the box
      const double t = (static_cast<double>(i % 128) + random.uniform()) / 64 - 1;
      const std::int64_t ray_index = i / 128;
      const auto ray = static_cast<double>(ray_index);
      points[3 * i] = 0.6 * std::cos(0.01 * ray) + 0.3 * t;
      points[3 * i + 1] = 0.7 * std::sin(0.013 * ray + 0.1);
      points[3 * i + 2] = t;
    }
  in[1].live_rows = s[4];
  return in;
}

double bilinear(const HostTensor& planes, int plane, double column, double row, std::int64_t channel) {
  const std::int64_t height = planes.shape[1], width = planes.shape[2], channels = planes.shape[3];
  const double u =
      std::clamp((column + 1) / 2 * static_cast<double>(width) - 0.5, 0.0, static_cast<double>(width - 1));
  const double v =
      std::clamp((row + 1) / 2 * static_cast<double>(height) - 0.5, 0.0, static_cast<double>(height - 1));
  const auto texel = [&](std::int64_t y, std::int64_t x) {
    x = std::min(x, width - 1);
    y = std::min(y, height - 1);
    return planes.data[((plane * height + y) * width + x) * channels + channel];
  };
  const auto x = static_cast<std::int64_t>(u), y = static_cast<std::int64_t>(v);
  const double fu = u - static_cast<double>(x), fv = v - static_cast<double>(y);
  return (1 - fv) * ((1 - fu) * texel(y, x) + fu * texel(y, x + 1)) +
         fv * ((1 - fu) * texel(y + 1, x) + fu * texel(y + 1, x + 1));
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const bool product = v.attributes.value("combine", "product") == "product";
  const std::int64_t live = v.sizes[4] < 0 ? v.sizes[0] : v.sizes[4];
  HostTensor y;
  y.shape = {v.sizes[0], v.sizes[3]};
  for (std::int64_t i = 0; i < live; ++i)
    for (std::int64_t c = 0; c < v.sizes[3]; ++c) {
      const double* p = &in[1].data[3 * i];
      const double xy = bilinear(in[0], 0, p[0], p[1], c), xz = bilinear(in[0], 1, p[0], p[2], c),
                   yz = bilinear(in[0], 2, p[1], p[2], c);
      y.data.push_back(product ? xy * xz * yz : xy + xz + yz);
    }
  return {y};
}

double elements(const Variation& v) { return static_cast<double>(v.sizes[0] * v.sizes[3]); }

const Register registration(OpCase{
    .op = "triplane_sample",
    .variations = {{{1, 1, 1, 16, -1, 0}},
                   {{97, 17, 20, 16, -1, 0}},
                   {{65, 5, 5, 16, 33, 0}, {{"partitions", 3}}},
                   {{40, 4, 6, 5, -1, 0}, {{"combine", "sum"}}},
                   {{530, 9, 8, 32, -1, 1}},
                   {{9000, 5, 5, 1, 8500, 0}, {{"partitions", 3}}}},  // more than one chunk of the sort
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{524288, 128, 128, 32, -1, 1}},
    .flops = [](const Variation& v) { return 23.0 * elements(v); },
    .bytes =
        [](const Variation& v) {
          return 4.0 *
                 (elements(v) + static_cast<double>(3 * (v.sizes[0] + v.sizes[1] * v.sizes[2] * v.sizes[3])));
        },
});

}  // namespace
}  // namespace vivant::cases
