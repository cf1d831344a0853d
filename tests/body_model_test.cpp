#include "vivant/model/body_model.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "cases/bumpy_sphere.hpp"
#include "io_helpers.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/model/human_sample_pool.hpp"
#include "vivant/model/signed_distance_grid.hpp"
#include "vivant/ops/inverse_warp.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

Pose random_pose(const Body& body, unsigned seed, double angle) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-angle, angle);
  Pose pose;
  for (int j = 0; j < body.joint_count(); ++j)
    pose.emplace_back(uniform(random), uniform(random), uniform(random));
  return pose;
}

std::vector<double> flat(const std::vector<Vector3d>& points) {
  return {points[0].data(), points[0].data() + 3 * points.size()};
}

Vector3d vector_at(const std::vector<double>& numbers, std::size_t row) {
  return Vector3d(numbers.data() + 3 * row);
}

const Body& asset_body() {
  static const Body body = load_body(asset_path("body.safetensors"));
  return body;
}

Camera camera_towards(const Vector3d& target, int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 1.2 * height;
  camera.cx = width / 2.0;
  camera.cy = height / 2.0;
  camera.world_to_camera = look_at(target + Vector3d(0.5, 0.3, 3), target, Vector3d::UnitY());
  return camera;
}

}  // namespace

TEST_CASE("body_model: a posed vertex warps to its vertex in the canonical pose") {
  Device device;
  for (const CanonicalPoseOptions& canonical :
       {CanonicalPoseOptions{}, CanonicalPoseOptions{.leg_angle = 0.35, .arm_angle = 0.25}}) {
    const BodyModel model(asset_body(), canonical);
    const Vector3d translation(0.5, 0.2, -3);
    const auto transforms = joint_transforms(model.body(), random_pose(model.body(), 7, 0.4), translation);
    const auto posed_vertices = skin(model.body(), transforms);
    Graph graph;
    const Value joints = graph.input("joint_transforms", {model.body().joint_count(), 12});
    const Value points = graph.input("points", {static_cast<std::int64_t>(posed_vertices.size()), 3});
    const BodyModel::Posed posed = model.pose(graph, joints);
    const ClosestPoint closest = closest_point(points, posed.mesh, 0.01);
    const CanonicalSamples warped = inverse_warp(points, {}, closest.face, closest.barycentric,
                                                 posed.mesh.index.triangles, posed.transforms);
    Executor executor(device, graph, {warped.points});
    executor.write(joints, std::span<const double>(transform_rows(transforms)));
    executor.write(points, std::span<const double>(flat(posed_vertices)));
    executor.run();
    const auto got = executor.read_doubles(warped.points);
    double worst = 0;
    for (std::size_t v = 0; v < posed_vertices.size(); ++v)
      worst = std::max(worst, (vector_at(got, v) - model.canonical_vertices()[v]).norm());
    MESSAGE("largest distance to the canonical vertex: ", worst, " m");
    CHECK(worst < 1e-5);
  }
}

TEST_CASE("body_model: only pixels of the visible window see the body") {
  Device device;
  const BodyModel model(asset_body());
  const Pose pose = random_pose(model.body(), 9, 0.3);
  const Vector3d translation(0.2, 0, -1);
  const auto vertices = skin(model.body(), joint_transforms(model.body(), pose, translation));
  const Camera camera = camera_towards(translation + Vector3d(0, 1, 0), 60, 80);
  const PoolOptions options{.step = 0.02, .samples_per_ray = 160, .rays_per_batch = 2048};
  const PixelWindow window = visible_window(camera, vertices, options.threshold);
  CHECK(window.width * window.height < camera.width * camera.height);
  HumanSamplePool pool(device, model, options);
  std::vector<Ray> rays;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column)
      rays.push_back(camera.ray({column + 0.5, row + 0.5}));
  pool.add_frame(0, pose, translation, rays);
  pool.finish();
  const auto counts = pool.ray_sample_counts();
  int seen_outside = 0, seen_inside = 0;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const bool inside = column >= window.x && column < window.x + window.width && row >= window.y &&
                          row < window.y + window.height;
      (inside ? seen_inside : seen_outside) += counts[row * camera.width + column] > 0;
    }
  CHECK(seen_outside == 0);
  CHECK(seen_inside > 300);
  CHECK(visible_window(camera, {camera.centre() - camera.forward()}, 0.1).empty());
}

TEST_CASE("human_sample_pool: samples of two frames lie on their rays and in the canonical box") {
  Device device;
  const BodyModel model(asset_body());
  const PoolOptions options{.step = 0.015, .threshold = 0.08, .rays_per_batch = 256};
  HumanSamplePool pool(device, model, options);
  std::vector<Ray> rays[2];
  std::vector<RigidTransform> transforms[2];
  for (int frame = 0; frame < 2; ++frame) {
    const Pose pose = random_pose(model.body(), 20 + frame, 0.3);
    const Vector3d translation(0.3 * frame, 0.1, -2);
    transforms[frame] = joint_transforms(model.body(), pose, translation);
    const Camera camera = camera_towards(translation + Vector3d(0, 1, 0), 24, 30);
    for (int row = 0; row < camera.height; ++row)
      for (int column = 0; column < camera.width; ++column)
        rays[frame].push_back(camera.ray({column + 0.5, row + 0.5}));
    pool.add_frame(frame + 5, pose, translation, rays[frame]);
  }
  pool.finish();
  const std::int64_t per_frame = 24 * 30, most = pool.samples_per_ray();
  REQUIRE(pool.ray_count() == 2 * per_frame);
  CHECK(pool.sample_count() > 2000);

  std::vector<std::int32_t> picked;
  for (std::int64_t r = 1; r < pool.ray_count(); r += 3) picked.push_back(static_cast<std::int32_t>(r));
  const auto count = static_cast<std::int64_t>(picked.size());
  Graph graph;
  const Value ids = graph.constant({count}, std::span<const std::int32_t>(picked));
  const Value jitter = graph.constant({count, 1}, std::span<const double>(std::vector<double>(count, 0.75)));
  const HumanSamples samples = gather_samples(pool.table(graph), ids, jitter, pool.step(), most);
  Executor executor(device, graph,
                    {samples.points, samples.directions, samples.root, samples.signed_distance, samples.frame,
                     samples.ids, samples.depths, samples.points.count(), samples.overflow,
                     samples.barycentric, samples.face, samples.normals});
  executor.run();
  CHECK(executor.read_ints(samples.overflow)[0] == 0);
  const int live = executor.read_ints(samples.points.count())[0];
  const auto places = executor.read_ints(samples.ids), frames = executor.read_ints(samples.frame);
  const auto faces = executor.read_ints(samples.face);
  const auto points = executor.read_doubles(samples.points), roots = executor.read_doubles(samples.root);
  const auto directions = executor.read_doubles(samples.directions),
             weights = executor.read_doubles(samples.barycentric);
  const auto depths = executor.read_doubles(samples.depths), normals = executor.read_doubles(samples.normals);
  const auto distances = executor.read_doubles(samples.signed_distance);
  const Box& box = model.canonical_box();
  const auto canonical_transforms =
      joint_transforms(model.body(), canonical_pose(model.body()), Vector3d::Zero());
  int outside = 0, expected = 0;
  double root_error = 0, distance_error = 0, normal_error = 0;
  std::vector<Vector3d> vertex_normals[2];
  for (int frame = 0; frame < 2; ++frame)
    vertex_normals[frame] =
        cases::angle_weighted_normals(skin(model.body(), transforms[frame]), model.body().triangles);
  for (std::int32_t ray : picked) expected += pool.ray_sample_counts()[ray];
  CHECK(live == expected);
  for (int i = 0; i < live; ++i) {
    const std::int32_t ray = picked[places[i] / most];
    const int frame = frames[i] - 5;
    REQUIRE(frame == ray / per_frame);
    const Ray& from = rays[frame][ray % per_frame];
    const Vector3d observed = from.origin + depths[places[i]] * from.direction;
    const auto& posed = transforms[frame];
    const Vector3d root = posed[0] * model.body().joints[0].homogeneous();
    root_error = std::max(
        root_error, (posed[0].leftCols<3>().transpose() * (observed - root) - vector_at(roots, i)).norm());
    outside += !Eigen::AlignedBox3d(box.min, box.max).contains(vector_at(points, i));
    CHECK(vector_at(directions, i).norm() == doctest::Approx(1).epsilon(1e-5));
    // The closest point on the posed body, from face and weights; jitter moved the sample by a quarter of a
    // step.
    const auto vertices_of_face = model.body().triangles[faces[i]];
    Vector3d foot = Vector3d::Zero(), normal = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      normal += weights[3 * i + k] * vertex_normals[frame][vertices_of_face[k]];
      RigidTransform blend = RigidTransform::Zero();
      for (int j = 0; j < model.body().influences; ++j) {
        const int at = vertices_of_face[k] * model.body().influences + j;
        blend += model.body().skin_weights[at] * posed[model.body().skin_joints[at]];
      }
      foot += weights[3 * i + k] * (blend * model.body().vertices[vertices_of_face[k]].homogeneous());
    }
    normal_error = std::max(normal_error, (normal.normalized() - vector_at(normals, i)).norm());
    const Vector3d before = observed - 0.25 * options.step * from.direction;
    distance_error = std::max(distance_error, std::abs((before - foot).norm() - std::abs(distances[i])));
  }
  CHECK(root_error < 1e-5);
  CHECK(distance_error < 1e-5);
  CHECK(normal_error < 1e-4);  // 16 bits
  CHECK(outside < live / 50);
}

TEST_CASE("signed_distance_grid: close to the exact distance") {
  Device device;
  const BodyModel model(asset_body());
  const SignedDistanceGrid grid(device, model);
  std::mt19937 random(12);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vector3d> points;
  points.reserve(4000);
  for (int i = 0; i < 4000; ++i)
    points.push_back(model.canonical_box().min + Vector3d(uniform(random), uniform(random), uniform(random))
                                                     .cwiseProduct(model.canonical_box().size()));
  Graph graph;
  const Value queries = graph.input("points", {4000, 3});
  const Value rough = grid.sample(graph, queries);
  const Value exact = closest_point(queries, model.canonical_mesh(graph), 3).signed_distance;
  Executor executor(device, graph, {rough, exact});
  executor.write(queries, std::span<const double>(flat(points)));
  executor.run();
  const auto got = executor.read_doubles(rough), want = executor.read_doubles(exact);
  double sum = 0, worst = 0;
  int wrong_side = 0, inside = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    sum += std::abs(got[i] - want[i]);
    worst = std::max(worst, std::abs(got[i] - want[i]));
    wrong_side += std::abs(want[i]) > 0.01 && (got[i] < 0) != (want[i] < 0);
    inside += want[i] < 0;
  }
  MESSAGE("grid ", grid.shape().text(), ": mean error ", sum / 4000, " m, largest ", worst, " m, inside ",
          inside);
  CHECK(sum / 4000 < 0.001);
  CHECK(worst < 0.0125);
  CHECK(wrong_side == 0);
  CHECK(inside > 100);
}
