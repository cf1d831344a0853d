#include "vivant/ops/rays.hpp"

#include <cmath>

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::array<std::size_t, 3> thin_group{64, 1, 1};

std::array<std::size_t, 3> items(std::int64_t number) { return {static_cast<std::size_t>(number), 1, 1}; }

void check_vectors(std::string_view op, std::string_view what, const Shape& shape) {
  if (shape.rank() != 2 || shape[1] != 3) fail("[{}] {} must be [N, 3], they are {}", op, what, shape.text());
}

void check_rays(std::string_view op, const TensorTypes& in) {
  check_vectors(op, "origins", in[0].shape);
  if (in[1].shape != in[0].shape)
    fail("[{}] directions are {}, origins {}", op, in[1].shape.text(), in[0].shape.text());
}

struct RayBox final : Op {
  explicit RayBox(double nearest) : nearest(nearest) {}
  std::string_view name() const override { return "ray_box"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_rays(name(), in);
    const std::int64_t rays = in[0].shape[0];
    if (in[2].shape != Shape{2, 3} && in[2].shape != Shape{rays, 6})
      fail("[ray_box] box must be [2, 3] or [{}, 6], it is {}", rays, in[2].shape.text());
    const TensorType per_ray{DType::real, {rays, 1}, in[0].count};
    return {per_ray, per_ray};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &origins = launch.in(0), &box = launch.in(2);
    launch.kernel("rays.cl", "ray_box")
        .args(origins, launch.in(1), box, launch.out(0), launch.out(1), origins[0],
              box.shape() == Shape{2, 3} ? 0 : 6, nearest, launch.count_of(origins))
        .run(items(origins[0]), thin_group);
  }
  const double nearest;
};

struct RayShell final : Op {
  explicit RayShell(const Shell& shell) : shell(shell) {}
  std::string_view name() const override { return "ray_shell"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_rays(name(), in);
    if (!(shell.inner_radius > 0 && shell.outer_radius > shell.inner_radius))
      fail("[ray_shell] the radii are {} and {}: the inner one must be above 0, the outer one above it",
           shell.inner_radius, shell.outer_radius);
    const TensorType per_ray{DType::real, {in[0].shape[0], 1}, in[0].count};
    return {per_ray, per_ray};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& origins = launch.in(0);
    launch.kernel("rays.cl", "ray_shell")
        .args(origins, launch.in(1), launch.out(0), launch.out(1), origins[0], shell.centre[0],
              shell.centre[1], shell.centre[2], shell.inner_radius, shell.outer_radius, shell.up[0],
              shell.up[1], shell.up[2], shell.inner_floor, shell.outer_floor, launch.count_of(origins))
        .run(items(origins[0]), thin_group);
  }
  const Shell shell;
};

struct PointsOnRaysGradient final : Op {
  std::string_view name() const override { return "points_on_rays_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const TensorType rays{DType::real, {in[0].shape[0], 3}};
    return {rays, rays};
  }
  void launch(Launch& launch) const override {
    const Tensor& depths = launch.in(0);
    launch.kernel("rays.cl", "points_on_rays_gradient")
        .args(depths, launch.in(1), launch.out(0), launch.out(1), depths[0], depths[1])
        .run(items(depths[0]), thin_group);
  }
};

struct PointsOnRays final : Op {
  std::string_view name() const override { return "points_on_rays"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_rays(name(), in);
    const Shape& depths = in[2].shape;
    if (depths.rank() != 2 || depths[0] != in[0].shape[0])
      fail("[points_on_rays] depths must be [{}, samples], they are {}", in[0].shape[0], depths.text());
    return {{DType::real, {depths.elements(), 3}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& depths = launch.in(2);
    launch.kernel("rays.cl", "points_on_rays")
        .args(launch.in(0), launch.in(1), depths, launch.out(), depths[0], depths[1])
        .run(items(depths.elements()), thin_group);
  }
  Values gradient(const GradientRequest& request) const override {
    const Values out =
        request.graph.record(std::make_shared<PointsOnRaysGradient>(), {request.in[2], request.grad()});
    return {out[0], out[1], {}};
  }
};

struct Space {
  std::array<double, 3> centre, half_extent;
  bool contracted;
};

Launch::Call normalise_kernel(Launch& launch, const std::string& function, const Space& space) {
  return launch.kernel("rays.cl", function, {{"CONTRACT", space.contracted ? 1 : 0}});
}

struct NormaliseGradient final : Op {
  explicit NormaliseGradient(const Space& space) : space(space) {}
  std::string_view name() const override { return "normalise_points_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const auto& [centre, half, contracted] = space;
    const Tensor& points = launch.in(0);
    normalise_kernel(launch, "normalise_points_gradient", space)
        .args(points, launch.in(1), launch.out(), centre[0], centre[1], centre[2], 1 / half[0], 1 / half[1],
              1 / half[2], points[0], launch.count_of(points))
        .run(items(points[0]), thin_group);
  }
  const Space space;
};

struct NormalisePoints final : Op {
  explicit NormalisePoints(const Space& space) : space(space) {}
  std::string_view name() const override { return space.contracted ? "contract" : "normalise_to_box"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_vectors(name(), "points", in[0].shape);
    for (double extent : space.half_extent)
      if (!(extent > 0)) fail("[{}] the extent {} is not positive", name(), extent);
    return {in[0]};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const auto& [centre, half, contracted] = space;
    const Tensor& points = launch.in(0);
    normalise_kernel(launch, "normalise_points", space)
        .args(points, launch.out(), centre[0], centre[1], centre[2], 1 / half[0], 1 / half[1], 1 / half[2],
              points[0], launch.count_of(points))
        .run(items(points[0]), thin_group);
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(NormaliseGradient(space), {request.in[0], request.grad()})};
  }
  const Space space;
};

const RegisterOp register_ray_box({
    .name = "ray_box",
    .summary = "where rays enter and leave a box",
    .inputs = {{"origins", "[R, 3]"}, {"directions", "[R, 3]"}, {"box", "[2, 3] or [R, 6]"}},
    .outputs = {{"near", "[R, 1]"}, {"far", "[R, 1]"}},
    .attributes = {{"nearest", 0.0, "the least near"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const Interval interval = ray_box(in[0], in[1], in[2], a.number("nearest"));
      return {interval.near, interval.far};
    },
});
const AttributeInfo centre_info[] = {{"x", 0.0, "centre"}, {"y", 0.0, "centre"}, {"z", 0.0, "centre"}};
std::array<double, 3> centre_of(const Attributes& a) { return {a.number("x"), a.number("y"), a.number("z")}; }
const RegisterOp register_ray_shell({
    .name = "ray_shell",
    .summary = "where rays leave the two sides of a shell and its floor",
    .inputs = {{"origins", "[R, 3]"}, {"directions", "[R, 3] of unit length"}},
    .outputs = {{"near", "[R, 1]"}, {"far", "[R, 1]"}},
    .attributes = {centre_info[0],
                   centre_info[1],
                   centre_info[2],
                   {"inner_radius", 1.0, "above 0"},
                   {"outer_radius", 2.0, "above inner_radius"},
                   {"slope_x", 0.0, "of the floor, up along +x"},
                   {"slope_z", 0.0, "of the floor, up along +z"},
                   {"inner_floor", Shell::no_floor, "the floor's upper side, below the centre"},
                   {"outer_floor", Shell::no_floor, "its lower side"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      const double x = a.number("slope_x"), z = a.number("slope_z"), length = std::sqrt(x * x + 1 + z * z);
      const Interval interval = ray_shell(in[0], in[1],
                                          {.centre = centre_of(a),
                                           .inner_radius = a.number("inner_radius"),
                                           .outer_radius = a.number("outer_radius"),
                                           .up = {-x / length, 1 / length, -z / length},
                                           .inner_floor = a.number("inner_floor"),
                                           .outer_floor = a.number("outer_floor")});
      return {interval.near, interval.far};
    },
});
const RegisterOp register_points_on_rays({
    .name = "points_on_rays",
    .summary = "origin + depth * direction",
    .inputs = {{"origins", "[R, 3]"}, {"directions", "[R, 3]"}, {"depths", "[R, S]"}},
    .outputs = {{"points", "[R * S, 3]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {points_on_rays(in[0], in[1], in[2])};
    },
});
const RegisterOp register_contract({
    .name = "contract",
    .summary = "all of space to [-1, 1]^3",
    .inputs = {{"points", "[N, 3]"}},
    .outputs = {{"y", "[N, 3]"}},
    .attributes = {centre_info[0], centre_info[1], centre_info[2], {"radius", 1.0, "of the linear part"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {contract(in[0], centre_of(a), a.number("radius"))};
    },
});
const RegisterOp register_normalise_to_box({
    .name = "normalise_to_box",
    .summary = "a box to [-1, 1]^3",
    .inputs = {{"points", "[N, 3]"}},
    .outputs = {{"y", "[N, 3]"}},
    .attributes = {centre_info[0],
                   centre_info[1],
                   centre_info[2],
                   {"half_width", 1.0, "along x"},
                   {"half_height", 1.0, "along y"},
                   {"half_depth", 1.0, "along z"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {normalise_to_box(in[0], centre_of(a),
                               {a.number("half_width"), a.number("half_height"), a.number("half_depth")})};
    },
});

}  // namespace

Interval ray_box(Value origins, Value directions, Value box, double nearest) {
  const Values out = origins.graph->record(std::make_shared<RayBox>(nearest), {origins, directions, box});
  return {out[0], out[1]};
}
Interval ray_shell(Value origins, Value directions, const Shell& shell) {
  const Values out = origins.graph->record(std::make_shared<RayShell>(shell), {origins, directions});
  return {out[0], out[1]};
}
Value points_on_rays(Value origins, Value directions, Value depths) {
  return origins.graph->record_one(PointsOnRays(), {origins, directions, depths});
}
Value normalise_to_box(Value points, std::array<double, 3> centre, std::array<double, 3> half_extent) {
  return points.graph->record_one(NormalisePoints({centre, half_extent, false}), {points});
}
Value contract(Value points, std::array<double, 3> centre, double radius) {
  return points.graph->record_one(NormalisePoints({centre, {radius, radius, radius}, true}), {points});
}

}  // namespace vivant
