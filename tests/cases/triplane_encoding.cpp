#include <algorithm>
#include <cmath>
#include <numbers>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

std::vector<double> encoded(const std::array<double, 3>& point, std::int64_t frequencies) {
  std::vector<double> code(point.begin(), point.end());
  for (std::int64_t l = 0; l < frequencies; ++l) {
    const double octave = std::pow(2.0, static_cast<double>(l)) * std::numbers::pi;
    for (double x : point) code.push_back(std::sin(octave * x));
    for (double x : point) code.push_back(std::cos(octave * x));
  }
  return code;
}

// sizes: side, occupied points (0: none)
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  HostTensor points;
  points.absent = v.sizes[1] == 0;
  if (!points.absent) points = random.tensor({v.sizes[1], 3}, -1, 0.5);
  points.differentiable = false;
  return {points};
}

// The average of the encoding over given points by pixel of each plane, with the number of points on the
// pixel.
void average(const std::vector<std::array<double, 3>>& points, std::int64_t size, std::int64_t frequencies,
             std::vector<double>& sums, std::vector<double>& counts) {
  const std::int64_t width = 3 * (1 + 2 * frequencies);
  sums.assign(3 * size * size * width, 0);
  counts.assign(3 * size * size, 0);
  const int axes[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  const auto cell = [&](double x) {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>((x + 1) / 2 * static_cast<double>(size)), 0,
                                    size - 1);
  };
  for (const auto& point : points) {
    const std::vector<double> code = encoded(point, frequencies);
    for (int plane = 0; plane < 3; ++plane) {
      const std::int64_t pixel =
          (plane * size + cell(point[axes[plane][1]])) * size + cell(point[axes[plane][0]]);
      counts[pixel] += 1;
      for (std::int64_t d = 0; d < width; ++d) sums[pixel * width + d] += code[d];
    }
  }
  for (std::size_t pixel = 0; pixel < counts.size(); ++pixel)
    for (std::int64_t d = 0; d < width && counts[pixel] > 0; ++d) sums[pixel * width + d] /= counts[pixel];
}

// Brute force: every voxel of the volume.
std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t size = v.sizes[0], frequencies = v.attributes.at("frequencies").get<std::int64_t>();
  const std::int64_t width = 3 * (1 + 2 * frequencies);
  std::vector<std::array<double, 3>> voxels, occupied;
  const auto centre = [&](std::int64_t i) {
    return (2.0 * static_cast<double>(i) + 1) / static_cast<double>(size) - 1;
  };
  for (std::int64_t x = 0; x < size; ++x)
    for (std::int64_t y = 0; y < size; ++y)
      for (std::int64_t z = 0; z < size; ++z) voxels.push_back({centre(x), centre(y), centre(z)});
  for (std::int64_t p = 0; p < v.sizes[1]; ++p)
    occupied.push_back({in[0].data[3 * p], in[0].data[3 * p + 1], in[0].data[3 * p + 2]});
  std::vector<double> full, near, full_count, near_count;
  average(voxels, size, frequencies, full, full_count);
  average(occupied, size, frequencies, near, near_count);
  HostTensor y;
  y.shape = {3, size, size, occupied.empty() ? width : 2 * width + 1};
  for (std::int64_t pixel = 0; pixel < 3 * size * size; ++pixel) {
    y.data.insert(y.data.end(), full.begin() + pixel * width, full.begin() + (pixel + 1) * width);
    if (occupied.empty()) continue;
    y.data.push_back(near_count[pixel] > 0 ? 1 : 0);
    y.data.insert(y.data.end(), near.begin() + pixel * width, near.begin() + (pixel + 1) * width);
  }
  return {y};
}

const Register registration(OpCase{
    .op = "triplane_encoding",
    .variations = {{{1, 0}, {{"size", 1}, {"frequencies", 1}}},
                   {{7, 0}, {{"size", 7}, {"frequencies", 4}}},
                   {{5, 23}, {{"size", 5}, {"frequencies", 3}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{128, 0}, {{"size", 128}, {"frequencies", 6}}},
    .flops = [](const Variation& v) { return 3.0 * 39 * static_cast<double>(v.sizes[0] * v.sizes[0]); },
    .bytes = [](const Variation& v) { return 12.0 * 39 * static_cast<double>(v.sizes[0] * v.sizes[0]); },
});

}  // namespace
}  // namespace vivant::cases
