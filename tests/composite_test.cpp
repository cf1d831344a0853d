#include "vivant/model/composite.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "graph_helpers.hpp"
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

/// Samples of one field as numbers, each with its own colour.
struct Samples {
  std::vector<float> depths, deltas, density;  // [R, S]
  std::vector<float> colours;                  // [N, 3]
  std::vector<std::int32_t> places;            // [N] among the R S
};

struct Pictures {
  std::vector<float> both, scene, person, person_alpha;
  Samples scene_samples, person_samples;
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
  const Value alpha = sum_channels(weights.weight), hidden = hidden_units(person.units);
  const Values pictures = {
      composite_output(graph, scene, human, composite(graph, behind, person, intervals, threshold)),
      scene.field().colour(graph, scene_alone.hidden, scene_alone.alpha),
      human.field().colour(graph, rendered_units(person.units, weights.weight, 0), alpha), alpha};
  const auto projected = [&](const Field& field, Value hidden) {  // every sample on its own, with the alpha 1
    const std::vector<double> ones(hidden.shape().rows(), 1.0);
    const Value alpha = graph.with_count(graph.constant({hidden.shape().rows(), 1}, ones), hidden.count());
    return field.colour(graph, hidden, alpha);
  };
  const Value scene_colours = projected(scene.field(), hidden_units(behind.units)),
              person_colours = projected(human.field(), hidden);
  Values outputs = pictures;
  outputs.insert(outputs.end(), {behind.depths, behind.deltas, behind.density, scene_colours, person.depths,
                                 person.deltas, person.density, person_colours, person.ids});
  Executor executor(device, graph, outputs);
  executor.write(cameras, std::span<const float>(camera_table(std::span(&camera, 1))));
  inputs.write(executor,
               {Pose(body.joint_count(), Vector3d::Zero()), Vector3d::Zero(), human.mixed_codes({})});
  executor.run();
  const auto read = [&](Value value) { return executor.read(value); };
  Pictures result{.both = read(pictures[0]),
                  .scene = read(pictures[1]),
                  .person = read(pictures[2]),
                  .person_alpha = read(pictures[3]),
                  .scene_samples = {read(behind.depths),
                                    read(behind.deltas),
                                    read(behind.density),
                                    read(scene_colours),
                                    {}},
                  .person_samples = {read(person.depths), read(person.deltas), read(person.density),
                                     read(person_colours), executor.read_ints(person.ids)}};
  result.scene_samples.places.resize(result.scene_samples.depths.size());
  std::iota(result.scene_samples.places.begin(), result.scene_samples.places.end(), 0);
  result.person_samples.places.resize(executor.read_ints(hidden.count())[0]);  // the others are undefined
  return result;
}

/// The plain form: the colours of all samples, sorted by depth and rendered in double precision.
std::vector<double> rendered_plainly(const Samples& scene, const Samples& person, Intervals intervals) {
  struct Sample {
    double depth, delta, density;
    const float* colour;
  };
  constexpr std::size_t rays = width * height;
  std::vector<std::vector<Sample>> samples(rays);
  for (const Samples* field : {&scene, &person})
    for (std::size_t k = 0; k < field->places.size(); ++k) {
      const std::size_t place = field->places[k];
      samples[place / (field->depths.size() / rays)].push_back(
          {field->depths[place], field->deltas[place], field->density[place], &field->colours[3 * k]});
    }
  std::vector<double> picture(3 * rays, 0.0);
  for (std::size_t r = 0; r < rays; ++r) {
    std::stable_sort(samples[r].begin(), samples[r].end(),
                     [](const Sample& a, const Sample& b) { return a.depth < b.depth; });
    double passes = 1;
    for (std::size_t i = 0; i < samples[r].size(); ++i) {
      const Sample& sample = samples[r][i];
      const bool to_next = intervals == Intervals::merged && i + 1 < samples[r].size();
      const double delta = to_next ? samples[r][i + 1].depth - sample.depth : sample.delta;
      const double opacity = 1 - std::exp(-sample.density * delta);
      for (int c = 0; c < 3; ++c) picture[3 * r + c] += passes * opacity * sample.colour[c];
      passes *= 1 - opacity;
    }
  }
  return picture;
}

double largest_difference(const std::vector<float>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < b.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
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

TEST_CASE(
    "composite: both fields rendered, then projected, are the projected samples sorted and rendered "
    "plainly") {
  Device device;
  for (const Intervals intervals : {Intervals::own, Intervals::merged}) {
    const Pictures pictures = render(device, -2, 3, intervals, 0);
    const std::vector<double> plain =
        rendered_plainly(pictures.scene_samples, pictures.person_samples, intervals);
    CHECK(largest_difference(pictures.both, plain) < tolerance(1e-5, 2e-2));
    CHECK(largest_difference(pictures.scene, plain) > 0.05);  // the person shows
  }
}

TEST_CASE("composite: merged intervals thin the wall behind an empty person") {
  Device device;
  const Pictures pictures = render(device, -1.5, nothing, Intervals::merged, 0);
  const auto plain = [&](Intervals intervals) {
    return rendered_plainly(pictures.scene_samples, pictures.person_samples, intervals);
  };
  CHECK(largest_difference(pictures.both, plain(Intervals::merged)) < tolerance(1e-5, 2e-2));
  CHECK(largest_difference(pictures.both, plain(Intervals::own)) > 0.01);
}
