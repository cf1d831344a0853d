#include "vivant/model/human_model.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "io_helpers.hpp"
#include "vivant/data/inside_mesh.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/model/canonical_points.hpp"
#include "vivant/model/human_losses.hpp"
#include "vivant/model/human_renderer.hpp"
#include "vivant/ops/loss.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

const Body& asset_body() {
  static const Body body = load_body(asset_path("body.safetensors"));
  return body;
}

HumanOptions small_options() {
  HumanOptions options;
  options.field = {.encoding = Encoding::vanilla, .plane_size = 16, .channels = 16, .density_bias = 4};
  options.error_layers = 2;
  options.error_width = 16;
  return options;
}

/// Random numbers in all parameters whose name starts with `prefix`.
void shake(ParameterStore& store, const std::string& prefix, double scale) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (const ParameterStore::Parameter& parameter : store.parameters()) {
    if (!parameter.name.starts_with(prefix)) continue;
    std::vector<float> values(parameter.shape.elements());
    for (float& value : values) value = static_cast<float>(scale) * uniform(random);
    store.write(parameter.name, values);
  }
}

Camera camera_before(const Vector3d& target) {
  Camera camera{.width = 24, .height = 40, .fx = 60, .fy = 60, .cx = 12, .cy = 20};
  camera.world_to_camera = look_at(target + Vector3d(0.4, 0.3, 3.5), target, Vector3d::UnitY());
  return camera;
}

Pose bent_pose(const Body& body) {
  Pose pose(body.joint_count(), Vector3d::Zero());
  pose[0] = {0.1, 0.7, -0.2};
  pose[5] = {0.4, 0, 0.1};
  pose[20] = {0, 0.3, 0.5};
  return pose;
}

/// The person and the camera before and after both are turned and shifted in the world.
struct MovedViews {
  PersonState state;
  Camera camera;
  const Eigen::Isometry3d move =
      Eigen::Translation3d(1.5, -0.7, 2) * Eigen::AngleAxisd(1.1, Vector3d(1, 2, -1).normalized());
  PersonView before, after;

  MovedViews(HumanRenderer& renderer, const Body& body, const HumanModel::CodeRow& codes)
      : state{bent_pose(body), Vector3d(0.2, 0.1, -1), codes},
        camera(camera_before(body.joints[0] + state.translation)),
        before(renderer.render(camera, state)) {
    const Vector3d root = body.joints[0] + state.translation;
    state.pose[0] = axis_angle_from_rotation(move.linear() * rotation_from_axis_angle(state.pose[0]));
    state.translation = move * root - body.joints[0];
    camera.world_to_camera = camera.world_to_camera * move.inverse().matrix();
    after = renderer.render(camera, state);
    REQUIRE(after.window.width == before.window.width);
  }
};

double largest_difference(const PersonView& a, const PersonView& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(a.pixels[i]) - b.pixels[i]));
  return worst;
}

}  // namespace

TEST_CASE("human_model: moving the root and the camera together changes neither E nor the picture") {
  Device device;
  ParameterStore store;
  HumanOptions options = small_options();
  options.error_input = ErrorInput::observed;
  const HumanModel model(device, store, Initializer(1), options, asset_body(), 2);
  store.allocate(device);
  shake(store, "human.error", 1);
  shake(store, "human.bone", 0.3);
  HumanRenderer renderer(device, model, {.step = 0.02, .tile_rays = 960});
  MovedViews views(renderer, model.body().body(), model.mixed_codes({{1, 1.0}}));
  REQUIRE(*std::max_element(views.before.alpha.begin(), views.before.alpha.end()) > 0.5);
  const double worst = largest_difference(views.before, views.after);
  views.state.codes.error.assign(views.state.codes.error.size(), 0.0f);
  const PersonView other = renderer.render(views.camera, views.state);
  CHECK(worst < 0.02);
  CHECK(largest_difference(other, views.after) > 2 * worst);  // the frame's code is used at all
}

TEST_CASE("human_model: light stays where it is when the person turns with the camera, with shading alone") {
  Device device;
  for (const bool shading : {false, true})
    for (const bool view_direction : {false, true}) {
      CAPTURE(shading);
      CAPTURE(view_direction);
      ParameterStore store;
      HumanOptions options = small_options();
      options.error_correction = options.bone_corrections = false;
      options.field.shading = shading;
      const HumanModel model(device, store, Initializer(1), options, asset_body(), 1);
      store.allocate(device);
      HumanRenderer::Options settings{.step = 0.02, .tile_rays = 960, .view_direction = view_direction};
      HumanRenderer renderer(device, model, settings);
      const MovedViews views(renderer, model.body().body(), model.mean_codes());
      REQUIRE(*std::max_element(views.before.alpha.begin(), views.before.alpha.end()) > 0.5);
      CHECK((largest_difference(views.before, views.after) > 0.05) == shading);
      // In a world that is turned, light that turns with it shows the same.
      settings.light = views.move.linear().transpose();
      HumanRenderer turned(device, model, settings);
      CHECK(largest_difference(views.before, turned.render(views.camera, views.state)) < 0.02);
    }
}

TEST_CASE("human_model: the picture is the same in a world with another unit, depths are in that unit") {
  Device device;
  ParameterStore store;
  const HumanModel model(device, store, Initializer(1), small_options(), asset_body(), 2);
  store.allocate(device);
  const Body& body = model.body().body();
  const PersonState state{bent_pose(body), Vector3d(0.2, 0.1, -1), model.mixed_codes({{1, 1.0}})};
  Camera camera = camera_before(body.joints[0] + state.translation);
  const PersonView metric =
      HumanRenderer(device, model, {.step = 0.02, .tile_rays = 960}).render(camera, state);
  constexpr double units = 2.5;
  camera.world_to_camera.topRightCorner<3, 1>() *= units;
  const PersonView scaled =
      HumanRenderer(device, model, {.step = 0.02, .tile_rays = 960, .units_per_metre = units})
          .render(camera, state);
  REQUIRE(scaled.window.width == metric.window.width);
  REQUIRE(*std::max_element(metric.alpha.begin(), metric.alpha.end()) > 0.5);
  double colour = 0, depth = 0;
  for (std::size_t i = 0; i < metric.alpha.size(); ++i) {
    colour = std::max<double>(colour, std::abs(scaled.pixels[3 * i] - metric.pixels[3 * i]));
    depth = std::max(depth, std::abs(scaled.depth[i] - units * metric.depth[i]));
  }
  CHECK(colour < 0.01);
  CHECK(depth < 0.01);
}

TEST_CASE("human_model: only codes of the frames in a batch get a gradient") {
  Device device;
  ParameterStore store;
  const HumanModel model(device, store, Initializer(1), small_options(), asset_body(), 4);
  store.allocate(device);
  shake(store, "human.error", 0.5);
  constexpr std::int64_t rows = 40;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::vector<double> points(3 * rows), thirds(3 * rows, 1.0 / 3);
  for (double& x : points) x = uniform(random);
  std::vector<std::int32_t> faces, frames;
  for (std::int32_t i = 0; i < rows; ++i) {
    faces.push_back(500 * i);
    frames.push_back(i % 2 == 0 ? 0 : 2);
  }
  Graph graph;
  const HumanSamples samples{.points = graph.constant({rows, 3}, points),
                             .directions = {},
                             .normals = {},
                             .root = graph.constant({rows, 3}, points),
                             .signed_distance = {},
                             .face = graph.constant({rows, 1}, std::span<const std::int32_t>(faces)),
                             .barycentric = graph.constant({rows, 3}, thirds),
                             .frame = graph.constant({rows, 1}, std::span<const std::int32_t>(frames)),
                             .ids = {},
                             .depths = {},
                             .deltas = {},
                             .rows = {},
                             .overflow = {}};
  const FrameCodes codes = model.codes(graph);
  const Value correction =
      model.correction(graph, samples, codes, graph.constant({1}, std::vector<double>{1}));
  const Values gradients =
      differentiate(graph, {correction}, {graph.constant({rows, 3}, points)}, {codes.error, codes.bones});
  Executor executor(device, graph, gradients);
  executor.run();
  for (const Value& gradient : gradients) {
    const std::vector<float> numbers = executor.read(gradient);
    const std::size_t width = numbers.size() / 4;
    for (std::size_t frame = 0; frame < 4; ++frame) {
      double size = 0;
      for (std::size_t k = 0; k < width; ++k) size += std::abs(numbers[frame * width + k]);
      CHECK((size > 0) == (frame % 2 == 0));
    }
  }
}

TEST_CASE("human_model: a canonical E corrects a place of the body alike wherever a pose puts it") {
  Device device;
  constexpr std::int64_t rows = 12;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::vector<double> canonical(3 * rows), here(3 * rows), there(3 * rows);
  for (std::vector<double>* points : {&canonical, &here, &there})
    for (double& x : *points) x = uniform(random);
  for (const ErrorInput input : {ErrorInput::canonical, ErrorInput::observed}) {
    HumanOptions options = small_options();
    options.bone_corrections = false;
    options.error_input = input;
    ParameterStore store;
    const HumanModel model(device, store, Initializer(1), options, asset_body(), 1);
    store.allocate(device);
    shake(store, "human.error", 0.5);
    Graph graph;
    const auto correction = [&](const std::vector<double>& root) {
      const HumanSamples samples{.points = graph.constant({rows, 3}, canonical),
                                 .directions = {},
                                 .normals = {},
                                 .root = graph.constant({rows, 3}, root),
                                 .signed_distance = {},
                                 .face = {},
                                 .barycentric = {},
                                 .frame = graph.constant({rows, 1}, std::vector<std::int32_t>(rows, 0)),
                                 .ids = {},
                                 .depths = {},
                                 .deltas = {},
                                 .rows = {},
                                 .overflow = {}};
      return model.correction(graph, samples, model.codes(graph),
                              graph.constant({1}, std::vector<double>{1}));
    };
    const Values both = {correction(here), correction(there)};
    Executor executor(device, graph, both);
    executor.run();
    CHECK((executor.read(both[0]) == executor.read(both[1])) == (input == ErrorInput::canonical));
    CHECK(executor.read(both[0])[0] != 0);
  }
}

TEST_CASE("canonical_points: colours are compared all over the body by area, at distances of centimetres") {
  Device device;
  ParameterStore store;
  const HumanModel model(device, store, Initializer(1), small_options(), asset_body(), 1);
  store.allocate(device);
  const CanonicalPoints points(device, model, 3);
  constexpr std::int64_t count = 8192;
  Graph graph;
  const RandomKey key{graph.scalar("seed", DType::i32), graph.scalar("step", DType::i32)};
  const CanonicalPoints::SurfacePairs pairs = points.surface(graph, count, key);
  Executor executor(device, graph, {pairs.a, pairs.b});
  executor.set(key.seed, 1);
  executor.set(key.step, 0);
  executor.run();
  const std::vector<float> a = executor.read(pairs.a), b = executor.read(pairs.b);
  double apart = 0, above = 0, on_head = 0;
  for (std::size_t i = 0; i < a.size(); ++i) apart += std::pow(a[i] - b[i], 2);
  for (const float distance : canonical_distances(device, model.body(), a, 0.1)) above += distance * distance;
  for (std::int64_t i = 0; i < count; ++i) on_head += a[3 * i + 1] > 1.45;
  CHECK(std::sqrt(apart / (3 * count)) == doctest::Approx(0.02).epsilon(0.03));
  CHECK(std::sqrt(above / count) == doctest::Approx(0.01).epsilon(0.1));
  // A third of the vertices are on the head, but less than a tenth of the skin.
  CHECK(on_head / count > 0.02);
  CHECK(on_head / count < 0.12);
}

TEST_CASE("human_losses: labels of L_smpl agree with the inside test of the canonical mesh") {
  Device device;
  const BodyModel body(asset_body());
  const InsideMesh inside(body.canonical_vertices(), body.body().triangles);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<float> points;
  const Box& box = body.canonical_box();
  for (int i = 0; i < 2000; ++i)
    for (int axis = 0; axis < 3; ++axis)
      points.push_back(static_cast<float>(box.min[axis] + box.size()[axis] * uniform(random)));
  const std::vector<float> distances = canonical_distances(device, body, points, 0.2);
  Graph graph;
  const BodyLabels labels =
      body_labels(graph.constant({2000, 1}, std::span<const float>(distances)), 0, 0.02);
  Executor executor(device, graph, {labels.inside, labels.decided});
  executor.run();
  const std::vector<float> is_inside = executor.read(labels.inside), decided = executor.read(labels.decided);
  int wrong = 0, inner = 0, free = 0;
  for (int i = 0; i < 2000; ++i) {
    if (std::abs(distances[i]) < 2e-4) continue;  // the label turns within a tenth of a millimetre
    const bool truth = inside.contains(Vector3d(points[3 * i], points[3 * i + 1], points[3 * i + 2]));
    inner += truth;
    free += decided[i] < 0.5;
    wrong +=
        is_inside[i] != (truth ? 1.0f : 0.0f) || decided[i] != (truth || distances[i] > 0.02f ? 1.0f : 0.0f);
  }
  CHECK(wrong == 0);
  CHECK(inner > 50);
  CHECK(free > 20);
}

TEST_CASE("human_losses: each is zero at its aim and as large as it should be elsewhere") {
  Device device;
  Graph graph;
  const auto rows = [&](std::vector<double> numbers, std::int64_t channels) {
    return graph.constant({static_cast<std::int64_t>(numbers.size()) / channels, channels}, numbers);
  };
  const Value distance = rows({-0.05, 0.01, 0.05}, 1), solid = rows({1e4, 7, 0}, 1),
              wrong = rows({0, 7, 1e4}, 1);
  const BodyLabels labels = body_labels(distance, 0.02, 0.02);
  const Values losses = {
      body_loss(solid, labels, 0.01),
      body_loss(wrong, labels, 0.01),
      body_loss(rows({1.5, 7, 0.25}, 1), labels, 0),
      l1_loss(over_background(rows({0.2, 0.2, 0.2}, 3), rows({0.5}, 1), rows({0.4, 0.6, 0.8}, 3)),
              rows({0.4, 0.5, 0.8}, 3)),
      masked_colour_loss(rows({1, 1, 1, 0.5, 0.5, 0.5}, 3), rows({0, 1}, 1),
                         rows({0, 0, 0, 0.2, 0.5, 0.5}, 3)),
      alpha_loss(rows({0.25, 0.25}, 1), rows({1, 0}, 1)),
      edge_loss(rows({0, 0, 1e4, 0}, 1), graph.constant({2, 2}, std::vector<double>{0.1, 0.1, 0.1, 0.1})),
      surface_colour_loss(rows({0.5, 0.5, 1.3}, 3), rows({0.5, 0.2, 1.3}, 3))};
  const std::vector<double> expected = {0,       2.0 / 3,  0.75 / 3, 0.2 / 3,
                                        0.3 / 6, 0.75 / 2, 0,        0.3 / 3 + 5 * 0.3 / 3};
  Executor executor(device, graph, losses);
  executor.run();
  for (std::size_t i = 0; i < losses.size(); ++i)
    CHECK(executor.read(losses[i])[0] == doctest::Approx(expected[i]).epsilon(1e-4).scale(1e-3));
}
