// The exact rewrites that make training and rendering fast, each against its plain form on small fields.
#include <algorithm>
#include <cmath>
#include <random>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/config.hpp"
#include "vivant/jobs/psnr.hpp"
#include "vivant/jobs/scene_trainer.hpp"
#include "vivant/jobs/synth.hpp"
#include "vivant/model/baked_planes.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/loss.hpp"
#include "vivant/ops/plane_variation.hpp"
#include "vivant/ops/random.hpp"
#include "vivant/ops/ray_distortion.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/volume_render.hpp"

using namespace vivant;

namespace {

constexpr std::int64_t ray_count = 48;
constexpr int sample_count = 24;

/// A small scene with planes from U-Nets, and what is asked of it.
struct Scene {
  Device& device = test_device();
  ParameterStore store;
  SceneModel model;
  explicit Scene(int direction_frequencies = 4)
      : model(device, store, Initializer(3),
              {.plane_size = 16,
               .channels = 16,
               .unet_widths = {16, 16},
               .direction_frequencies = direction_frequencies,
               .density_bias = 1},
              {.radius = Eigen::Vector3d(2, 2, 2), .near = 0.2, .far = 5, .opaque_last = false},
              sample_count) {
    store.allocate(device);
  }

  /// Rays from around (0, 0, -2.5) into the scene, others for every `seed`.
  static Rays rays(Graph& graph, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-0.4, 0.4);
    std::vector<double> origins, directions;
    for (std::int64_t r = 0; r < ray_count; ++r) {
      const Eigen::Vector3d direction = Eigen::Vector3d(uniform(random), uniform(random), 1).normalized();
      for (const double x : {uniform(random), uniform(random), -2.5}) origins.push_back(x);
      directions.insert(directions.end(), direction.begin(), direction.end());
    }
    return {graph.constant({ray_count, 3}, origins), graph.constant({ray_count, 3}, directions)};
  }
  Value colour(Graph& graph, Value planes, unsigned seed, double threshold = 0) const {
    const RenderedRays rendered =
        model.render(graph, model.sample(graph, planes, rays(graph, seed), nullptr), threshold);
    return model.field().colour(graph, rendered.hidden, rendered.alpha);
  }
  Values parameters(Graph& graph, const std::string& prefix = "scene.") {
    Values values;
    for (const ParameterStore::Parameter& parameter : store.parameters())
      if (parameter.name.starts_with(prefix) && !parameter.name.starts_with("scene.feature"))
        values.push_back(store.value(graph, parameter.name));
    return values;
  }
};

/// A loss with a different gradient for every element.
Value uneven_loss(Value x) { return l2_loss(x, affine(x.graph->detach(x), 0.3, 0.2)); }

double relative_error(const std::vector<float>& a, const std::vector<float>& b) {
  REQUIRE(a.size() == b.size());
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference += std::pow(static_cast<double>(a[i]) - b[i], 2);
    size += std::pow(static_cast<double>(b[i]), 2);
  }
  REQUIRE(size > 0);
  return std::sqrt(difference / size);
}

double largest(const std::vector<float>& numbers) {
  return *std::max_element(numbers.begin(), numbers.end());
}

/// The mean loss over the ray batches of the scene's first training step, on the planes given.
Value mean_loss(Graph& graph, Value planes, const Config& config, const Capture& capture,
                const DeviceCapture& data, const SceneModel& scene) {
  const auto number = [&](std::int64_t x) {
    return graph.constant({1}, std::vector<std::int32_t>{static_cast<std::int32_t>(x)});
  };
  const Value seed = number(config.training.seed), step = number(0);
  const std::vector<std::int32_t> background =
      background_pixels(capture, data.frames(), config.scene.mask_dilation);
  const Value pixels = graph.constant({static_cast<std::int64_t>(background.size())}, background);
  const int batches = static_cast<int>(config.scene.batches_per_step);
  Value total;
  for (int batch = 0; batch < batches; ++batch) {
    const RandomKey pixels_key{seed, step, 3 * batch}, jitter_key{seed, step, 3 * batch + 1};
    const Value ids = pick(pixels, config.scene.rays, pixels_key);
    const Rays rays = ray_generation(data.cameras(graph), ids, data.width(), data.height());
    const FieldSamples samples = scene.sample(graph, planes, rays, &jitter_key);
    const RenderedRays rendered = scene.render(graph, samples, config.scene.weight_threshold);
    const Value error = l2_loss(scene.field().colour(graph, rendered.hidden, rendered.alpha),
                                image_gather(data.images(graph), ids));
    const Value spread = ray_distortion(rendered.weight, samples.depths, samples.range.near,
                                        samples.range.far, scene.spacing());
    const Value loss = add(error, affine(mean(spread), config.scene.distortion_weight));
    total = total ? add(total, loss) : loss;
  }
  return add(affine(total, 1.0 / batches), affine(plane_variation(planes), config.scene.variation_weight));
}

/// The first moments after one step are the gradients, times 1 - beta1.
void check_first_step(const Capture& capture, const std::string& planes,
                      const std::vector<std::string>& more = {}) {
  CAPTURE(planes);
  std::vector<std::string> settings = {"scene.planes=" + planes,     "scene.plane_size=16",
                                       "scene.unet_widths=[16, 16]", "scene.rays=64",
                                       "scene.samples=16",           "scene.batches_per_step=3",
                                       "scene.variation_weight=0",   "scene.distortion_weight=0",
                                       "scene.coarse_samples=0",     "scene.cameras=given",
                                       "scene.exposure_rate=0"};
  settings.insert(settings.end(), more.begin(), more.end());
  const Config config = load_config("demo", std::nullopt, settings);
  Device& device = test_device();
  CaptureModel model(device, config, capture);
  const DeviceCapture data(device, capture, capture.training_frames());
  ParameterStore& store = model.store();
  Graph graph;
  std::vector<std::string> names;
  Values parameters;
  for (const ParameterStore::Parameter& parameter : store.parameters())
    if (parameter.name.starts_with("scene.") && !parameter.name.starts_with("scene.feature")) {
      names.push_back(parameter.name);
      parameters.push_back(store.value(graph, parameter.name));
    }
  const Value loss =
      mean_loss(graph, model.scene().field().planes(graph), config, capture, data, model.scene());
  const Values gradients = differentiate(graph, loss, parameters);
  Run plain(graph, gradients);
  std::vector<std::vector<float>> expected;
  for (const Value& gradient : gradients) expected.push_back(plain.read(gradient));  // before the step

  SceneTrainer trainer(device, config, capture, data, model);
  trainer.run(0);
  const StepReport report = trainer.report(1);
  const bool regularised = config.scene.variation_weight > 0;
  CHECK((psnr_of(*report.loss) < *report.psnr - 0.01) ==
        regularised);  // the PSNR is that of the colours alone
  for (std::size_t i = 0; i < names.size(); ++i) {
    CAPTURE(names[i]);
    std::vector<float> moments = store.read(names[i], ParameterStore::Kind::first_moment);
    for (float& moment : moments) moment /= static_cast<float>(1 - config.training.adam_beta1);
    CHECK(relative_error(moments, expected[i]) < 1e-4);
  }
}

}  // namespace

TEST_CASE("rewrites: baked planes give the bits of planes computed in the graph") {
  Scene scene;
  const BakedPlanes baked(scene.device, scene.model.field());
  Graph plain, quick;
  const Value expected = scene.colour(plain, scene.model.field().planes(plain), 1);
  const Value got = scene.colour(quick, baked.value(quick), 1);
  Run plain_run(plain, {expected}), quick_run(quick, {got});
  const std::vector<float> before = plain_run.read(expected);
  CHECK(quick_run.read(got) == before);
  std::vector<float> bias = scene.store.read("scene.unet_xy.out.bias");
  bias[0] += 1;
  scene.store.write("scene.unet_xy.out.bias", bias);
  CHECK(plain_run.read(expected) != before);
  CHECK(quick_run.read(got) == before);  // what was baked stays
}

TEST_CASE("rewrites: rendering hidden units and projecting once is projecting every sample, gradients too") {
  Scene scene;
  Graph graph;
  const Field& field = scene.model.field();
  const FieldSamples samples = scene.model.sample(graph, field.planes(graph), Scene::rays(graph, 1), nullptr);
  const RenderedRays rendered = scene.model.render(graph, samples);
  const Value quick = field.colour(graph, rendered.hidden, rendered.alpha);
  // Every sample has the alpha 1 of its own; then its colour is rendered.
  const Value ones =
      graph.constant({ray_count * sample_count, 1}, std::vector<double>(ray_count * sample_count, 1.0));
  const Value colours = field.colour(graph, hidden_units(samples.units), ones);
  const Value plain = weighted_sum(rendered.weight, colours);
  const Values parameters = scene.parameters(graph);
  Values outputs = {quick, plain};
  for (const Value& rgb : {quick, plain}) {
    const Values gradients = differentiate(graph, uneven_loss(rgb), parameters);
    outputs.insert(outputs.end(), gradients.begin(), gradients.end());
  }
  Run run(graph, outputs);
  CHECK(relative_error(run.read(quick), run.read(plain)) < tolerance(1e-6));
  CHECK(largest(run.read(plain)) > 0.1);
  for (std::size_t i = 0; i < parameters.size(); ++i)
    CHECK(relative_error(run.read(outputs[2 + i]), run.read(outputs[2 + parameters.size() + i])) <
          tolerance(1e-4));
}

TEST_CASE(
    "rewrites: what density first leaves out stays within samples times threshold times the largest unit") {
  Scene scene;
  Graph graph;
  const Field& field = scene.model.field();
  const FieldSamples samples = scene.model.sample(graph, field.planes(graph), Scene::rays(graph, 1), nullptr);
  const RenderedRays plain = scene.model.render(graph, samples);
  const Value hidden = hidden_units(samples.units);
  for (const double threshold : {1e-4, 1e-2}) {
    const RenderedRays quick = scene.model.render(graph, samples, threshold);
    const Value plain_colour = field.colour(graph, plain.hidden, plain.alpha),
                quick_colour = field.colour(graph, quick.hidden, quick.alpha);
    Run run(graph, {plain.hidden, quick.hidden, hidden, plain.weight, plain_colour, quick_colour});
    const std::vector<float> all = run.read(plain.hidden), some = run.read(quick.hidden),
                             weights = run.read(plain.weight), all_rgb = run.read(plain_colour),
                             some_rgb = run.read(quick_colour);
    const double bound = sample_count * threshold * largest(run.read(hidden));
    CHECK(std::any_of(weights.begin(), weights.end(), [&](float w) { return w > 0 && w <= threshold; }));
    double least = 0, most = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      least = std::min(least, static_cast<double>(all[i]) - some[i]);  // units are not negative
      most = std::max(most, static_cast<double>(all[i]) - some[i]);
    }
    CHECK(least > -1e-6);
    CHECK(most > 0);
    CHECK(most <= bound);
    // A colour changes by at most the bound times the sum of its row of the last layer.
    const std::vector<float> last = scene.store.read("scene.colour.weight");
    for (int c = 0; c < 3; ++c) {
      double row = 0, change = 0;
      for (std::size_t k = 0; k < Field::hidden_width; ++k) row += std::abs(last[3 * k + c]);
      for (std::int64_t r = 0; r < ray_count; ++r)
        change = std::max(change, std::abs(static_cast<double>(all_rgb[3 * r + c]) - some_rgb[3 * r + c]));
      CHECK(change <= bound * row + 1e-6);
    }
  }
}

TEST_CASE("rewrites: density first trains as the plain form whose light samples have no weight") {
  constexpr double threshold = 1e-2;
  for (const int direction_frequencies : {0, 4}) {  // without, the hidden layer's term is one row for all
    CAPTURE(direction_frequencies);
    Scene scene(direction_frequencies);
    Graph graph;
    const Field& field = scene.model.field();
    const FieldSamples samples =
        scene.model.sample(graph, field.planes(graph), Scene::rays(graph, 1), nullptr);
    const RenderedRays quick = scene.model.render(graph, samples, threshold);
    std::vector<float> weights;
    {
      Run run(graph, {quick.weight});
      weights = run.read(quick.weight);
    }
    std::vector<double> heavy(weights.size());
    std::transform(weights.begin(), weights.end(), heavy.begin(), [](float w) { return w > threshold; });
    CHECK(std::count(heavy.begin(), heavy.end(), 0.0) > 100);
    const Value masked = multiply(quick.weight, graph.constant(quick.weight.shape(), heavy));
    const Value plain = weighted_sum(masked, hidden_units(samples.units));
    const Values parameters = scene.parameters(graph);
    Values outputs = {quick.hidden, plain};
    for (const Value& hidden : {quick.hidden, plain}) {
      const Value loss = uneven_loss(field.colour(graph, hidden, quick.alpha));
      const Values gradients = differentiate(graph, loss, parameters);
      outputs.insert(outputs.end(), gradients.begin(), gradients.end());
    }
    Run run(graph, outputs);
    CHECK(relative_error(run.read(quick.hidden), run.read(plain)) < tolerance(1e-6));
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const std::vector<float> expected = run.read(outputs[2 + parameters.size() + i]);
      const std::vector<float> got = run.read(outputs[2 + i]);
      if (largest(expected) == 0)
        CHECK(got == expected);  // the direction's weights when no direction is looked at
      else
        CHECK(relative_error(got, expected) < tolerance(1e-4));
    }
  }
}

TEST_CASE("rewrites: what the demo preset's weight threshold leaves out hardly turns the gradients") {
  Scene scene;
  Graph graph;
  const Field& field = scene.model.field();
  const FieldSamples samples = scene.model.sample(graph, field.planes(graph), Scene::rays(graph, 1), nullptr);
  const Values parameters = scene.parameters(graph);
  Values outputs;
  for (const double threshold : {0.0, preset_config("demo").scene.weight_threshold}) {
    const RenderedRays rendered = scene.model.render(graph, samples, threshold);
    outputs.push_back(rendered.hidden);
    const Value loss = uneven_loss(field.colour(graph, rendered.hidden, rendered.alpha));
    const Values gradients = differentiate(graph, loss, parameters);
    outputs.insert(outputs.end(), gradients.begin(), gradients.end());
  }
  Run run(graph, outputs);
  const std::size_t half = outputs.size() / 2;
  CHECK(run.read(outputs[half]) != run.read(outputs[0]));
  for (std::size_t i = 1; i < half; ++i) {
    // Eight degrees; the density's, which cancel most, turn by six. Trained on a synthetic capture with and
    // without the threshold, held-out views differed by less than 0.1 dB.
    CHECK(relative_error(run.read(outputs[half + i]), run.read(outputs[i])) < 0.14);
  }
}

TEST_CASE("rewrites: gradients gathered on the planes over ray batches are those of the summed loss") {
  Scene scene;
  Graph graph;
  const Value planes = scene.model.field().planes(graph);
  const Values unets = scene.parameters(graph, "scene.unet");
  Value total, gathered;
  for (unsigned batch = 1; batch <= 3; ++batch) {
    const Value loss = uneven_loss(scene.colour(graph, planes, batch));
    const Value gradient = differentiate(graph, loss, {planes}).front();
    total = total ? add(total, loss) : loss;
    gathered = gathered ? add(gathered, gradient) : gradient;
  }
  const Values plain = differentiate(graph, total, unets),
               quick = differentiate(graph, {planes}, {gathered}, unets);
  Values outputs = plain;
  outputs.insert(outputs.end(), quick.begin(), quick.end());
  Run run(graph, outputs);
  for (std::size_t i = 0; i < unets.size(); ++i)
    CHECK(relative_error(run.read(quick[i]), run.read(plain[i])) < 1e-5);
}

TEST_CASE(
    "rewrites: a training step of the scene takes the gradients of the mean loss over its ray batches") {
  const TemporaryFolder folder;
  synthesise({.output = folder.path(), .frames = 9, .width = 48, .height = 32, .motion = {}});
  const Capture capture = load_capture(folder.path());
  for (const char* planes : {"full", "vanilla"}) {
    check_first_step(capture, planes);
    check_first_step(capture, planes,
                     {"scene.variation_weight=0.3", "scene.distortion_weight=0.2", "scene.coarse_samples=8"});
  }
}
