#pragma once
#include <array>
#include <string>

#include "vivant/ops/random.hpp"

namespace vivant {

struct Rays {
  Value origins, directions;  ///< [R, 3]
};

/// World rays through pixel centres. `cameras` [F, 20] is a camera_table of frames of the same size; `pixels`
/// i32 [R] or [R, 1] are (frame * height + row) * width + column. Directions have unit length. The lens
/// distortion is undone by Newton's method. A count of pixels passes on. No gradient.
Rays ray_generation(Value cameras, Value pixels, int width, int height);

/// Rays of cameras that are turned and moved a little: `corrections` [F, 6] hold for every frame a rotation
/// about the ray's origin (2 tan(angle / 2) times its axis, radians where it is small) and a translation in
/// multiples of `unit`, both in the world; pixels i32 [R] or [R, 1] as above, of frames of `frame_pixels`.
/// Gradient of the corrections.
Rays ray_correction(const Rays& rays, Value pixels, Value corrections, std::int64_t frame_pixels,
                    double unit = 1);

struct Interval {
  Value near, far;  ///< [R, 1], multiples of the direction; both 0 for a ray that misses
};

/// Where rays are inside a box [2, 3] (lower corner, upper corner), or [R, 6] with a box for every ray.
/// `near` is at least `nearest`. No gradient.
Interval ray_box(Value origins, Value directions, Value box, double nearest = 0);

/// A shell around a place, cut off below by a floor: metres or any unit, inner < outer.
struct Shell {
  std::array<double, 3> centre = {};
  double inner_radius = 1, outer_radius = 2;
  std::array<double, 3> up = {0, 1, 0};  ///< unit length
  static constexpr double no_floor = 1e30;
  double inner_floor = no_floor, outer_floor = no_floor;  ///< its upper and lower side, below the centre

  bool has_floor() const { return outer_floor < no_floor; }
};

/// Where rays of unit direction leave the inner and the outer side of a shell: the ball's, or the floor's
/// where that comes first. A ray that passes the ball has the point nearest to its centre. near > 0, far >
/// near. No gradient.
Interval ray_shell(Value origins, Value directions, const Shell& shell);

/// How samples are spread between near and far: evenly, or evenly in 1 / depth.
enum class Spacing { linear, disparity };
Spacing spacing_from(const std::string& name);

struct Samples {
  Value depths, deltas;  ///< [R, S]
};

/// One sample in each of `samples` strata between near and far [R, 1], ascending: at a random place of the
/// stratum, or in its middle without `jitter`. Every interval reaches to the next sample, the last one to
/// far. Disparity needs near > 0 (rays with near = far = 0 give zeros). No gradient.
Samples stratified_samples(Value near, Value far, int samples, Spacing spacing, const RandomKey& key,
                           bool jitter = true);

/// Samples where the weight of coarse samples is, ascending: depths and weight [R, S] as render_weights takes
/// and gives them, near and far [R, 1] -> [R, samples]. A sample's weight counts for the bin from it to the
/// next one; a part of the samples looks everywhere (NeRF's hierarchical sampling,
/// Mildenhall et al. 2020, section 5.2, with the widened bins of Mip-NeRF). With `jitter` at random, else at
/// fixed fractions. No gradient.
Samples importance_samples(Value depths, Value weight, Value near, Value far, int samples,
                           const RandomKey& key, bool jitter = true);

/// deltas [R, S] of ascending depths [R, S]: to the next depth, the last one to far [R, 1].
Value sample_intervals(Value depths, Value far);

/// origin + depth * direction: origins and directions [R, 3], depths [R, S] -> [R * S, 3]. Gradients of
/// origins and directions.
Value points_on_rays(Value origins, Value directions, Value depths);

/// (x - centre) / half_extent, axis by axis: an axis-aligned box to [-1, 1]^3. points [N, 3], with a
/// gradient.
Value normalise_to_box(Value points, std::array<double, 3> centre, std::array<double, 3> half_extent);

/// All of space to [-1, 1]^3: with y = (x - centre) / radius and m = max |y_k|, y / 2 where m <= 1, and
/// (2 - 1 / m) y / (2 m) outside (Barron et al., mip-NeRF 360, with the maximum norm). With a gradient.
Value contract(Value points, std::array<double, 3> centre, double radius);

}  // namespace vivant
