#include "rays.hpp"

#include <Eigen/Dense>

#include "workload.hpp"

namespace vivant::bench {
namespace {

constexpr std::int64_t frame_height = 270, frame_width = 480;

/// The ray of a camera at (0.3, 0.2, -2.2) that looks along z, its focal length a frame's width.
void add_ray(HostRays& rays, std::int64_t pixel, std::int64_t height, std::int64_t width) {
  const std::int64_t row = pixel / width, column = pixel % width;
  const double x = static_cast<double>(column) + 0.5, y = static_cast<double>(row) + 0.5;
  const double w = static_cast<double>(width), h = static_cast<double>(height);
  const Eigen::Vector3d direction = Eigen::Vector3d((x - w / 2) / w, (y - h / 2) / w, 1).normalized();
  for (const double number : {0.3, 0.2, -2.2}) rays.origins.push_back(static_cast<float>(number));
  for (const double number : direction) rays.directions.push_back(static_cast<float>(number));
}

}  // namespace

HostRays random_rays(std::int64_t count) {
  HostRays rays;
  for (const float place : numbers("pixels", count, {0, frame_height * frame_width}))
    add_ray(rays, static_cast<std::int64_t>(place), frame_height, frame_width);
  return rays;
}

HostRays frame_rays(std::int64_t height, std::int64_t width) {
  HostRays rays;
  for (std::int64_t pixel = 0; pixel < height * width; ++pixel) add_ray(rays, pixel, height, width);
  return rays;
}

std::vector<float> ray_points(std::int64_t count, std::int64_t samples) {
  const HostRays rays = random_rays(count);
  std::vector<float> points;
  for (std::int64_t ray = 0; ray < count; ++ray)
    for (std::int64_t sample = 0; sample < samples; ++sample) {
      const double fraction = (static_cast<double>(sample) + 0.5) / static_cast<double>(samples);
      const double depth = nearest + (farthest - nearest) * fraction;
      for (int axis = 0; axis < 3; ++axis)
        points.push_back(
            static_cast<float>(rays.origins[3 * ray + axis] + depth * rays.directions[3 * ray + axis]));
    }
  return points;
}

}  // namespace vivant::bench
