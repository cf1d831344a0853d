#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: frames, rays, live rays (-1: all)

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const double width = v.attributes["width"], height = v.attributes["height"];
  HostTensor cameras, pixels;
  cameras.shape = {v.sizes[0], 20};
  for (std::int64_t f = 0; f < v.sizes[0]; ++f) {
    for (double number : {0.9 * width, 0.95 * width, 0.51 * width, 0.48 * height})
      cameras.data.push_back(number);
    for (double most : {0.1, 0.05, 0.01, 0.01})  // the first camera has no distortion
      cameras.data.push_back(f == 0 ? 0 : random.uniform(-most, most));
    const double angle = random.uniform(0, 6), c = std::cos(angle), s = std::sin(angle);
    for (double number : {c, 0.0, s, 0.3, 0.0, 1.0, 0.0, -2.0, -s, 0.0, c, 1.1})
      cameras.data.push_back(number);
  }
  cameras.differentiable = false;
  pixels.dtype = DType::i32;
  pixels.shape = {v.sizes[1], 1};
  for (std::int64_t r = 0; r < v.sizes[1]; ++r)
    pixels.data.push_back(
        static_cast<double>(random.integer(v.sizes[0] * static_cast<std::int64_t>(width * height))));
  pixels.live_rows = v.sizes[2];
  return {cameras, pixels};
}

/// Undistortion by fixed-point iteration, as OpenCV does it.
void undistort(const double* lens, double& x, double& y) {
  const double x0 = x, y0 = y, k1 = lens[0], k2 = lens[1], p1 = lens[2], p2 = lens[3];
  for (int i = 0; i < 200; ++i) {
    const double r2 = x * x + y * y, radial = 1 + k1 * r2 + k2 * r2 * r2;
    const double dx = 2 * p1 * x * y + p2 * (r2 + 2 * x * x), dy = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    x = (x0 - dx) / radial;
    y = (y0 - dy) / radial;
  }
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t width = v.attributes["width"], height = v.attributes["height"];
  HostTensor origins, directions;
  origins.shape = directions.shape = {v.sizes[1], 3};
  for (std::int64_t r = 0; r < (v.sizes[2] < 0 ? v.sizes[1] : v.sizes[2]); ++r) {
    const auto pixel = static_cast<std::int64_t>(in[1].data[r]);
    const double* camera = &in[0].data[pixel / (width * height) * 20];
    double x = (static_cast<double>(pixel % width) + 0.5 - camera[2]) / camera[0];
    double y = (static_cast<double>(pixel / width % height) + 0.5 - camera[3]) / camera[1];
    undistort(camera + 4, x, y);
    const double length = std::sqrt(x * x + y * y + 1);
    for (const double* row = camera + 8; row < camera + 20; row += 4) {
      origins.data.push_back(row[3]);
      directions.data.push_back((row[0] * x + row[1] * y + row[2]) / length);
    }
  }
  return {origins, directions};
}

const Register registration(OpCase{
    .op = "ray_generation",
    .variations = {{{1, 5, -1}, {{"width", 1}, {"height", 1}}},
                   {{4, 97, 80}, {{"width", 13}, {"height", 7}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{16, 65536, -1}, {{"width", 640}, {"height", 360}}},
    .bytes = [](const Variation& v) { return 28.0 * static_cast<double>(v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
