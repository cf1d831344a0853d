// Human rays are traced only in the window where the body is and near its surface; the plain form evaluates
// every sample of every ray.
#include <cmath>
#include <numeric>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "vivant/data/camera_table.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/model/human_renderer.hpp"
#include "vivant/ops/concat.hpp"
#include "vivant/ops/inverse_warp.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/volume_render.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

constexpr int width = 24, height = 40;
constexpr std::int64_t rays_count = width * height;
constexpr double step = 0.02, threshold = 0.06, nearest = 2.4;  // metres
constexpr std::int64_t steps = 110;                             // to 4.6 m, behind the body

struct Plain {
  std::vector<float> rgb, alpha;
};

/// The closest point of every sample, then the field at every sample; those farther than the threshold have
/// no length.
Plain render_plainly(Device& device, const HumanModel& model, const Camera& camera,
                     const PersonState& state) {
  const BodyModel& body = model.body();
  const std::int64_t count = rays_count * steps;
  std::vector<std::int32_t> pixels(rays_count), ids(count), frames(count, 0);
  std::iota(pixels.begin(), pixels.end(), 0);
  std::iota(ids.begin(), ids.end(), 0);
  std::vector<double> depth_rows;
  for (std::int64_t r = 0; r < rays_count; ++r)
    for (std::int64_t k = 0; k < steps; ++k) depth_rows.push_back(nearest + (k + 0.5) * step);

  Graph graph;
  const std::vector<float> table = camera_table(std::span(&camera, 1));
  const Rays rays =
      ray_generation(graph.constant({1, camera_table_columns}, std::span<const float>(table)),
                     graph.constant({rays_count}, std::span<const std::int32_t>(pixels)), width, height);
  const std::vector<double> transforms =
      transform_rows(joint_transforms(body.body(), state.pose, state.translation));
  const Value joints = graph.constant({body.body().joint_count(), 12}, std::span<const double>(transforms));
  const BodyModel::Posed posed = body.pose(graph, joints);
  const Value depths = graph.constant({rays_count, steps}, std::span<const double>(depth_rows));
  const Value points = points_on_rays(rays.origins, rays.directions, depths);
  const ClosestPoint closest = closest_point(points, posed.mesh, 0.3);
  const Value directions = graph.reshape(
      points_on_rays(affine(rays.origins, 0), rays.directions, affine(depths, 0, 1)), {count, 3});
  const CanonicalSamples canonical = inverse_warp(points, directions, closest.face, closest.barycentric,
                                                  posed.mesh.index.triangles, posed.transforms);
  const Value roots = body.root_rays(rays.origins, rays.directions, joints);
  const Value distance = add(activate(closest.signed_distance, Activation::relu),
                             activate(affine(closest.signed_distance, -1), Activation::relu));
  const Value near = clamp(affine(distance, -1e6, 1e6 * threshold), 0, 1);  // 1 below the threshold, else 0
  const HumanSamples samples{.points = canonical.points,
                             .directions = canonical.directions,
                             .normals = {},
                             .root = points_on_rays(slice(roots, 1, 0, 3), slice(roots, 1, 3, 3), depths),
                             .signed_distance = closest.signed_distance,
                             .face = closest.face,
                             .barycentric = closest.barycentric,
                             .frame = graph.constant({count, 1}, std::span<const std::int32_t>(frames)),
                             .ids = graph.constant({count}, std::span<const std::int32_t>(ids)),
                             .depths = depths,
                             .deltas = graph.reshape(affine(near, step), {rays_count, steps}),
                             .rows = {},
                             .overflow = {}};
  const std::vector<float>&error = state.codes.error, &bones = state.codes.bones;
  const FrameCodes codes{
      .error = graph.constant({1, static_cast<std::int64_t>(error.size())}, std::span<const float>(error)),
      .bones = graph.constant({1, body.body().joint_count(), 6}, std::span<const float>(bones))};
  const HumanFieldSamples field = model.query(graph, model.field().planes(graph), samples, codes,
                                              graph.constant({1}, std::vector<double>{1}));
  const RenderWeights weights = render_weights(field.density, field.deltas, field.depths);
  const Value alpha = sum_channels(weights.weight);
  const Value rgb =
      model.field().colour(graph, weighted_sum(weights.weight, hidden_units(field.units), field.ids), alpha);
  Executor executor(device, graph, {rgb, alpha});
  executor.run();
  return {executor.read(rgb), executor.read(alpha)};
}

}  // namespace

TEST_CASE("rewrites: culled human rays show what evaluating every sample of every ray shows") {
  Device device;
  ParameterStore store;
  const HumanOptions options{
      .field = {.encoding = Encoding::vanilla, .plane_size = 16, .channels = 16, .density_bias = 2},
      .error_layers = 2,
      .error_width = 16};
  const HumanModel model(device, store, Initializer(1), options, load_body(asset_path("body.safetensors")),
                         1);
  store.allocate(device);
  const Body& body = model.body().body();
  PersonState state{Pose(body.joint_count(), Vector3d::Zero()), Vector3d(0.2, 0.1, -1),
                    model.mixed_codes({})};
  state.pose[0] = {0.1, 0.7, -0.2};
  state.pose[5] = {0.4, 0, 0.1};
  state.pose[20] = {0, 0.3, 0.5};
  for (std::size_t i = 0; i < state.codes.bones.size(); ++i)
    state.codes.bones[i] = static_cast<float>(0.2 * std::sin(3.0 * static_cast<double>(i)));
  const Vector3d target = body.joints[0] + state.translation;
  Camera camera{.width = width, .height = height, .fx = 50, .fy = 50, .cx = 12, .cy = 20};
  camera.world_to_camera = look_at(target + Vector3d(0.4, 0.3, 3.5), target, Vector3d::UnitY());

  const Plain plain = render_plainly(device, model, camera, state);
  HumanRenderer renderer(device, model, {.step = step, .threshold = threshold, .tile_rays = 256});
  const PersonView view = renderer.render(camera, state);
  REQUIRE_FALSE(view.window.empty());
  REQUIRE(view.window.width < width);  // something is culled
  int seen = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int i = y * width + x, u = x - view.window.x, v = y - view.window.y;
      const bool inside = u >= 0 && v >= 0 && u < view.window.width && v < view.window.height;
      CAPTURE(x);
      CAPTURE(y);
      if (!inside) {
        CHECK(plain.alpha[i] == 0);
        continue;
      }
      const int j = v * view.window.width + u;
      seen += plain.alpha[i] > 0.5;
      // Records keep directions and places on triangles in 16 bits.
      CHECK(std::abs(view.alpha[j] - plain.alpha[i]) < 2e-3);
      for (int c = 0; c < 3; ++c)
        CHECK(std::abs(view.pixels[3 * j + c] - plain.rgb[3 * i + c]) < tolerance(2e-3));
    }
  CHECK(seen > 50);
}
