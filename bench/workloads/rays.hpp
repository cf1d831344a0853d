#pragma once
#include <cstdint>
#include <vector>

namespace vivant::bench {

/// Rays of a camera in front of the box [-1, 1]^3, [rays, 3] each.
struct HostRays {
  std::vector<float> origins, directions;
};
/// Where they are sampled.
inline constexpr double nearest = 1.2, farthest = 3.2;

/// Random pixels of a 480x270 frame, as a training step draws them.
HostRays random_rays(std::int64_t rays);
/// All pixels of a frame, row by row.
HostRays frame_rays(std::int64_t height, std::int64_t width);
/// Points in the middle of `samples` equal parts of every random ray, [rays * samples, 3].
std::vector<float> ray_points(std::int64_t rays, std::int64_t samples);

}  // namespace vivant::bench
