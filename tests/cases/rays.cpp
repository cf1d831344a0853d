#include <algorithm>
#include <cmath>

#include "cases/op_case.hpp"
#include "vivant/ops/rays.hpp"

namespace vivant::cases {
namespace {

// sizes of ray_box: rays, 1 for a box per ray, live rays (-1: all)
std::vector<HostTensor> rays_and_box(const Variation& v, Random& random) {
  const std::int64_t rays = v.sizes[0];
  std::vector<HostTensor> in = {random.tensor({rays, 3}, -3, 3), random.tensor({rays, 3})};
  for (std::int64_t r = 0; r < rays; r += 5) {  // along an axis, from a face's plane
    for (int axis = 0; axis < 3; ++axis) in[1].data[3 * r + axis] = axis == r % 3 ? 1 : 0;
    in[0].data[3 * r] = -1;
  }
  HostTensor box;
  box.shape = v.sizes[1] == 1 ? Shape{rays, 6} : Shape{2, 3};
  for (std::int64_t r = 0; r < box.shape.elements() / 6; ++r)
    for (double x : {-1.0, -2.0, -1.5, 1.0, 0.5, 2.0}) box.data.push_back(x + (r % 3) * 0.25);
  in.push_back(box);
  for (HostTensor& tensor : in) tensor.differentiable = false;
  in[0].live_rows = v.sizes[2];
  return in;
}

std::vector<HostTensor> near_and_far(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor near, far;
  near.shape = far.shape = {v.sizes[0], 1};
  for (std::int64_t r = 0; r < (v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2]); ++r) {
    double enter = v.attributes.value("nearest", 0.0), leave = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
      const double* box = &in[2].data[(v.sizes[1] == 1 ? 6 * r : 0) + axis];
      const double o = in[0].data[3 * r + axis], d = in[1].data[3 * r + axis];
      if (d == 0 && (o < box[0] || o > box[3])) leave = -1;
      if (d == 0) continue;
      enter = std::max(enter, std::min((box[0] - o) / d, (box[3] - o) / d));
      leave = std::min(leave, std::max((box[0] - o) / d, (box[3] - o) / d));
    }
    near.data.push_back(leave > enter ? enter : 0);
    far.data.push_back(leave > enter ? leave : 0);
  }
  return {near, far};
}

// sizes of ray_shell: rays, live rays (-1: all)
std::vector<HostTensor> rays_of_unit_length(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], 3}, -4, 4), random.tensor({v.sizes[0], 3})};
  for (std::int64_t r = 0; r < v.sizes[0]; ++r) {
    for (int axis = 0; axis < 3 && r % 3 == 0; ++axis) in[0].data[3 * r + axis] *= 0.1;  // from the middle
    double* d = &in[1].data[3 * r];
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int axis = 0; axis < 3; ++axis) d[axis] /= length;
  }
  for (HostTensor& tensor : in) tensor.differentiable = false;
  in[0].live_rows = v.sizes[1];
  return in;
}

std::vector<HostTensor> shell_depths(const Variation& v, const std::vector<HostTensor>& in) {
  const nlohmann::json& a = v.attributes;
  const double centre[] = {a.value("x", 0.0), a.value("y", 0.0), a.value("z", 0.0)};
  const double slope_x = a.value("slope_x", 0.0), slope_z = a.value("slope_z", 0.0);
  const double steepness = std::sqrt(slope_x * slope_x + 1 + slope_z * slope_z);
  HostTensor near, far;
  near.shape = far.shape = {v.sizes[0], 1};
  for (std::int64_t r = 0; r < (v.sizes[1] < 0 ? v.sizes[0] : v.sizes[1]); ++r) {
    double o[3], half_b = 0, square = 0;
    const double* d = &in[1].data[3 * r];
    for (int axis = 0; axis < 3; ++axis) {
      o[axis] = in[0].data[3 * r + axis] - centre[axis];
      half_b += o[axis] * d[axis];
      square += o[axis] * o[axis];
    }
    // |o + t d| = radius, and the height of o + t d above the floor = 0.
    const auto leave = [&](double radius, double floor) {
      const double discriminant = half_b * half_b - square + radius * radius;
      double depth = -half_b + std::sqrt(std::max(0.0, discriminant));
      const double height = (o[1] - slope_x * o[0] - slope_z * o[2]) / steepness + floor;
      const double rise = (d[1] - slope_x * d[0] - slope_z * d[2]) / steepness;
      if (height > 0 && rise < 0) depth = std::min(depth, -height / rise);
      return depth;
    };
    const double inner = a.value("inner_radius", 1.0), least = 1e-3 * inner;
    near.data.push_back(std::max(leave(inner, a.value("inner_floor", Shell::no_floor)), least));
    far.data.push_back(std::max(leave(a.value("outer_radius", 2.0), a.value("outer_floor", Shell::no_floor)),
                                near.data.back() + least));
  }
  return {near, far};
}

// sizes of points_on_rays: rays, samples
std::vector<HostTensor> rays_and_depths(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], 3}), random.tensor({v.sizes[0], 3}),
                                random.tensor({v.sizes[0], v.sizes[1]})};
  in[2].differentiable = false;
  return in;
}

std::vector<HostTensor> points(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor y;
  y.shape = {v.sizes[0] * v.sizes[1], 3};
  for (std::int64_t i = 0; i < y.shape[0]; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t k = i / v.sizes[1] * 3 + axis;
      y.data.push_back(in[0].data[k] + in[2].data[i] * in[1].data[k]);
    }
  return {y};
}

// sizes of contract and normalise_to_box: points, live points (-1: all)
std::vector<HostTensor> scattered(const Variation& v, Random& random) {
  HostTensor x = random.tensor({v.sizes[0], 3}, -6, 6);
  for (std::size_t i = 0; i < x.data.size(); ++i)
    if (i / 3 % 2 == 0) x.data[i] *= 0.2;  // half of them inside
  x.live_rows = v.sizes[1];
  return {x};
}

std::vector<HostTensor> normalised(const Variation& v, const std::vector<HostTensor>& in) {
  const nlohmann::json& a = v.attributes;
  const bool contracted = a.contains("radius");
  const double centre[] = {a.value("x", 0.0), a.value("y", 0.0), a.value("z", 0.0)};
  const double half[] = {a.value("half_width", 1.0), a.value("half_height", 1.0), a.value("half_depth", 1.0)};
  HostTensor y;
  y.shape = in[0].shape;
  for (std::int64_t i = 0; i < (v.sizes[1] < 0 ? v.sizes[0] : v.sizes[1]); ++i) {
    double p[3], largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] =
          (in[0].data[3 * i + axis] - centre[axis]) / (contracted ? a["radius"].get<double>() : half[axis]);
      largest = std::max(largest, std::abs(p[axis]));
    }
    const double factor = !contracted ? 1 : largest <= 1 ? 0.5 : 0.5 * (2 - 1 / largest) / largest;
    for (double x : p) y.data.push_back(factor * x);
  }
  return {y};
}

double rows(const Variation& v) { return static_cast<double>(v.sizes[0]); }

const Register register_ray_box(OpCase{
    .op = "ray_box",
    .variations = {{{40, 0, -1}}, {{67, 1, 50}, {{"nearest", 0.7}}}},
    .inputs = rays_and_box,
    .reference = near_and_far,
    .benchmark = {{65536, 0, -1}},
    .bytes = [](const Variation& v) { return 32.0 * rows(v); },
});
const Register register_ray_shell(OpCase{
    .op = "ray_shell",
    .variations = {{{40, -1}},
                   {{67, 50},
                    {{"x", 0.3},
                     {"y", -0.2},
                     {"z", 0.5},
                     {"inner_radius", 3.0},
                     {"outer_radius", 4.0},
                     {"slope_x", 0.2},
                     {"slope_z", -0.1},
                     {"inner_floor", 0.7},
                     {"outer_floor", 0.8}}}},
    .inputs = rays_of_unit_length,
    .reference = shell_depths,
    .benchmark = {{65536, -1}, {{"inner_floor", 0.7}, {"outer_floor", 0.8}}},
    .bytes = [](const Variation& v) { return 32.0 * rows(v); },
});
const Register register_points_on_rays(OpCase{
    .op = "points_on_rays",
    .variations = {{{1, 1}}, {{13, 17}}},
    .inputs = rays_and_depths,
    .reference = points,
    .benchmark = {{16384, 128}},
    .bytes = [](const Variation& v) { return 16.0 * rows(v) * static_cast<double>(v.sizes[1]); },
});
const Register register_contract(OpCase{
    .op = "contract",
    .variations = {{{97, 60}, {{"x", 0.1}, {"y", -0.4}, {"z", 0.2}, {"radius", 1.7}}}},
    .inputs = scattered,
    .reference = normalised,
    .benchmark = {{2097152, -1}, {{"radius", 1.7}}},
    .bytes = [](const Variation& v) { return 24.0 * rows(v); },
});
const Register register_normalise_to_box(OpCase{
    .op = "normalise_to_box",
    .variations = {{{70, -1}, {{"x", 0.1}, {"half_width", 2.0}, {"half_height", 0.5}, {"half_depth", 1.5}}}},
    .inputs = scattered,
    .reference = normalised,
    .benchmark = {{2097152, -1}},
    .bytes = [](const Variation& v) { return 24.0 * rows(v); },
});

}  // namespace
}  // namespace vivant::cases
