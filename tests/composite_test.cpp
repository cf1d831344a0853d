#include "vivant/model/composite.hpp"

#include <algorithm>
#include <numeric>

#include "io_helpers.hpp"
#include "vivant/data/camera_table.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/model/human_renderer.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/volume_render.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

constexpr double nothing = -1e4;  // a density bias whose exponential is 0
constexpr int width = 16, height = 24;

struct Pictures {
  std::vector<float> both, scene, person, person_alpha;
};

/// A person in front of a scene, and each alone, in one graph on the real samples.
Pictures render(Device& device, double scene_bias, double human_bias, Intervals intervals, double threshold) {
  const Body body = load_body(asset_path("body.safetensors"));
  const FieldOptions field{.encoding = Encoding::vanilla, .plane_size = 16, .channels = 16};
  FieldOptions scene_field = field;
  scene_field.density_bias = scene_bias;
  HumanOptions human_field{.field = field, .error_layers = 1, .error_width = 16};
  human_field.field.density_bias = human_bias;
  const Vector3d target = body.joints[0];
  SceneSpace space;
  space.centre = target;
  space.radius = Vector3d(4, 4, 4);
  space.near = 0.5;
  space.far = 6;
  ParameterStore store;
  const SceneModel scene(device, store, Initializer(1), scene_field, space, 24);
  const HumanModel human(device, store, Initializer(2), human_field, body, 1);
  store.allocate(device);

  Camera camera{.width = width, .height = height, .fx = 36, .fy = 36, .cx = 8, .cy = 12};
  camera.world_to_camera = look_at(target + Vector3d(0.4, 0.3, 3.5), target, Vector3d::UnitY());
  std::vector<std::int32_t> pixels(width * height);
  std::iota(pixels.begin(), pixels.end(), 0);
  Graph graph;
  const Value cameras = graph.input("camera", {1, camera_table_columns});
  const Rays rays = ray_generation(
      cameras, graph.constant({width * height}, std::span<const std::int32_t>(pixels)), width, height);
  PersonInputs inputs(graph, human);
  const HumanFieldSamples person =
      inputs.sample(graph, human.field().planes(graph), rays, {.step = 0.03, .samples_per_ray = 40}, 0, true);
  const FieldSamples behind = scene.sample(graph, scene.field().planes(graph), rays, nullptr);
  const RenderedRays scene_alone = scene.render(graph, behind, threshold);
  const RenderWeights weights = render_weights(person.density, person.deltas, person.depths);
  const Value alpha = sum_channels(weights.weight);
  const Values pictures = {
      composite_output(graph, scene, human, composite(graph, scene, behind, person, intervals, threshold)),
      scene.field().colour(graph, scene_alone.hidden, scene_alone.alpha),
      human.field().colour(graph, weighted_sum(weights.weight, person.hidden, person.ids), alpha), alpha};
  Executor executor(device, graph, pictures);
  executor.write(cameras, std::span<const float>(camera_table(std::span(&camera, 1))));
  inputs.write(executor,
               {Pose(body.joint_count(), Vector3d::Zero()), Vector3d::Zero(), human.mixed_codes({})});
  executor.run();
  return {executor.read(pictures[0]), executor.read(pictures[1]), executor.read(pictures[2]),
          executor.read(pictures[3])};
}

float largest(const std::vector<float>& numbers) { return *std::max_element(numbers.begin(), numbers.end()); }

}  // namespace

TEST_CASE("composite: a person without density leaves exactly the scene") {
  Device device;
  for (const double threshold : {0.0, 1e-4}) {
    const Pictures pictures = render(device, -1.5, nothing, Intervals::own, threshold);
    CHECK(pictures.both == pictures.scene);
    CHECK(largest(pictures.scene) > 0.05);
  }
}

TEST_CASE("composite: a scene without density leaves exactly the person") {
  Device device;
  const Pictures pictures = render(device, nothing, 4, Intervals::own, 0);
  CHECK(pictures.both == pictures.person);
  CHECK(largest(pictures.person_alpha) > 0.9);
}

TEST_CASE("composite: a solid person hides the scene behind, and pixels beside the person show the scene") {
  Device device;
  const Pictures pictures = render(device, -4, 8, Intervals::own, 0);
  int on_person = 0, beside = 0;
  for (std::size_t i = 0; i < pictures.person_alpha.size(); ++i) {
    if (pictures.person_alpha[i] > 0.999) ++on_person;
    if (pictures.person_alpha[i] > 0) continue;
    ++beside;
    for (int c = 0; c < 3; ++c) CHECK(pictures.both[3 * i + c] == pictures.scene[3 * i + c]);
  }
  CHECK(on_person > 5);
  CHECK(beside > 50);
  CHECK(pictures.both != pictures.scene);
}

TEST_CASE("composite: merged intervals thin the wall behind an empty person") {
  Device device;
  const Pictures pictures = render(device, -1.5, nothing, Intervals::merged, 0);
  CHECK(pictures.both != pictures.scene);
}
