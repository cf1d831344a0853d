#include "vivant/jobs/human_trainer.hpp"

#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "graph_helpers.hpp"
#include "small_capture.hpp"
#include "vivant/jobs/capture_model.hpp"
#include "vivant/model/human_renderer.hpp"
#include "vivant/model/unseen_surface.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/reduction.hpp"

using namespace vivant;

namespace {

Config small_config() {
  return load_config(
      "demo", std::nullopt,
      {"human.planes=full", "human.plane_size=32", "human.unet_widths=[16, 32, 64]", "human.rays=512",
       "human.batches_per_step=1", "human.steps=500", "human.box_points=128", "human.warmup_steps=5",
       "human.edge_weight=0.02", "human.correction_start=0", "human.sample_step=0.03",
       "human.corrections=learned", "scene.plane_size=16", "scene.unet_widths=[16, 32]"});
}

/// The training frames without the person: the mask's pixels are filled from around.
std::vector<cv::Mat> backgrounds() {
  std::vector<cv::Mat> pictures;
  for (const int frame : small_capture().training_frames()) {
    cv::Mat picture = small_capture().image(frame), around, share, person;
    cv::dilate(small_capture().mask(frame), person, {});
    picture.setTo(0, person);
    cv::blur(picture, around, {15, 15});
    cv::blur(255 - person, share, {15, 15});
    cv::cvtColor(share, share, cv::COLOR_GRAY2BGR);
    cv::divide(around, share, around, 255);
    around.copyTo(picture, person);
    pictures.push_back(picture);
  }
  return pictures;
}

/// A new model and its trainer.
struct Training {
  Device device;
  const Capture& capture = small_capture();
  Config config = small_config();
  CaptureModel model{device, config, capture};
  HumanTrainer trainer;

  explicit Training(double room = 1.25)
      : trainer(device, config, capture, model.store(), *model.human(), backgrounds(), room) {}
  void run(std::int64_t from, std::int64_t to) {
    for (std::int64_t step = from; step < to; ++step) trainer.run(step);
    CHECK_FALSE(trainer.failure());
  }
  std::vector<float> parameters() {
    std::vector<float> all;
    for (const ParameterStore::Parameter& parameter : model.store().parameters())
      if (parameter.name.starts_with("human.")) {
        const std::vector<float> values = model.store().read(parameter.name);
        all.insert(all.end(), values.begin(), values.end());
      }
    return all;
  }
};

/// How the rendered person agrees with a frame that was held out.
struct Agreement {
  double overlap;  ///< of mask and silhouette: intersection over union
  double error;    ///< of the colours on the mask, in parts of what one colour for all of it would give
};

Agreement agreement(Training& training) {
  const Capture& capture = training.capture;
  const int frame = capture.held_out_frames().front();
  const HumanModel& human = *training.model.human();
  HumanRenderer renderer(training.device, human, human_renderer_options(training.config, true));
  const PersonView view =
      renderer.render(capture.frames[frame].camera, captured_state(human, capture, frame));
  const cv::Mat image = capture.image(frame), mask = capture.mask(frame) >= 128;
  cv::Mat silhouette = cv::Mat::zeros(image.size(), CV_8UC1);
  cv::Mat drawn(image.size(), CV_8UC3, cv::Scalar::all(128));
  for (int y = 0; y < view.window.height; ++y)
    for (int x = 0; x < view.window.width; ++x)
      if (view.alpha[static_cast<std::size_t>(y) * view.window.width + x] >= 0.5f)
        silhouette.at<std::uint8_t>(view.window.y + y, view.window.x + x) = 255;
  view.draw_over(drawn);
  const cv::Mat flat(image.size(), CV_8UC3, cv::mean(image, mask));
  return {static_cast<double>(cv::countNonZero(mask & silhouette)) / cv::countNonZero(mask | silhouette),
          cv::norm(drawn, image, cv::NORM_L1, mask) / cv::norm(flat, image, cv::NORM_L1, mask)};
}

HumanRays rays_with(Training& training, HumanRayOptions options, int unseen_views) {
  options.unseen_views = unseen_views;
  return HumanRays(training.device, training.model.human()->body(), training.capture,
                   training.capture.training_frames(), backgrounds(), options);
}

}  // namespace

TEST_CASE("human rays: masks of fitted poses have soft borders, those of exact ones are as stored") {
  Training training;
  Config config = training.config;
  config.human.mask_softness = 0.02;
  CHECK(human_ray_options(config, true).mask_softness == 0);
  CHECK(human_ray_options(config, false).mask_softness == 0.02);
  const auto masks = [&](bool exact) {
    const HumanRays rays = rays_with(training, human_ray_options(config, exact), 0);
    Graph graph;
    const std::int64_t count = rays.samples().ray_count();
    std::vector<std::int32_t> all(count);
    std::iota(all.begin(), all.end(), 0);
    const Value mask =
        image_gather(rays.masks(graph), graph.constant({count}, std::span<const std::int32_t>(all)));
    Executor run(training.device, graph, {mask});
    run.run();
    return run.read(mask);
  };
  const auto between = [](const std::vector<float>& values) {
    return std::count_if(values.begin(), values.end(), [](float m) { return m > 0.01f && m < 0.99f; });
  };
  const std::vector<float> soft = masks(false), stored = masks(true);
  CHECK(between(stored) == 0);
  CHECK(between(soft) > 100);
  double difference = 0;  // of the shares of pixels that are the person's
  for (std::size_t i = 0; i < soft.size(); ++i) difference += soft[i] - stored[i];
  CHECK(std::abs(difference) < 0.02 * std::accumulate(stored.begin(), stored.end(), 0.0));
}

TEST_CASE("human rays: views of the unseen surface come after the pictures'") {
  Training training;
  const Body& body = training.model.human()->body().body();
  const std::vector<int> frames = training.capture.training_frames();
  const HumanRayOptions options = human_ray_options(training.config, true);
  std::vector<float> expected;
  for (const UnseenView& view : unseen_views(body, training.capture, frames, 3, 0))
    for (const cv::Vec3b& colour : view.colours)
      for (int c = 0; c < 3; ++c) expected.push_back(static_cast<float>(colour[c]) / 255);
  const HumanRays without = rays_with(training, options, 0), with = rays_with(training, options, 3);
  const std::int64_t before = without.samples().ray_count(), count = with.samples().ray_count() - before;
  REQUIRE(count > 0);
  REQUIRE(3 * count == static_cast<std::int64_t>(expected.size()));
  std::vector<std::int32_t> rays(count);
  std::iota(rays.begin(), rays.end(), static_cast<std::int32_t>(before));
  Graph graph;
  const Value index = graph.constant({count}, std::span<const std::int32_t>(rays)),
              colours = image_gather(with.colours(graph), index),
              backgrounds_there = image_gather(with.backgrounds(graph), index),
              masks = image_gather(with.masks(graph), index);
  Executor run(training.device, graph, {colours, backgrounds_there, masks});
  run.run();
  const std::vector<float> found = run.read(colours);
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK(found[i] == doctest::Approx(expected[i]));
  CHECK(run.read(backgrounds_there) == found);
  for (const float mask : run.read(masks)) CHECK(mask == 1);
  const auto draws = [&](const HumanRays& of) {
    Graph alone;
    const Value drawn = of.drawn(alone);
    return Executor(training.device, alone, {drawn}).read_ints(drawn);
  };
  // Every ray once, then again those on the masks of the pictures.
  const std::vector<std::int32_t> first = draws(without);
  std::vector<std::int32_t> all(before + count);
  std::iota(all.begin(), all.end(), 0);
  all.insert(all.end(), first.begin() + before, first.end());
  CHECK(draws(with) == all);
}

TEST_CASE("human rays: made-up views train the field, and no frame's codes") {
  Training training;
  const HumanModel& human = *training.model.human();
  const HumanRayOptions options = human_ray_options(training.config, false);
  const HumanRays without = rays_with(training, options, 0), with = rays_with(training, options, 3);
  CHECK_FALSE(without.has_unseen_views());
  CHECK(with.has_unseen_views());
  // The sums of the gradients' sizes: of the bones' codes, of the error's codes, of the density's layer.
  const auto gradients = [&](std::int64_t first) {
    constexpr std::int64_t count = 50;
    std::vector<std::int32_t> rays(count);
    std::iota(rays.begin(), rays.end(), static_cast<std::int32_t>(first));
    Graph graph;
    const auto number = [&](std::int64_t rows, double value) {
      return graph.constant({rows, 1}, std::vector<double>(rows, value));
    };
    const HumanSamples samples = gather_samples(
        with.samples().table(graph), graph.constant({count}, std::span<const std::int32_t>(rays)),
        number(count, 0.5), with.samples().step(), with.samples().samples_per_ray(), 4096);
    const HumanFieldSamples field = human.query(graph, human.field().planes(graph), samples,
                                                with_constant_copies(graph, human.codes(graph)),
                                                graph.constant({1}, std::vector<double>{1.0}));
    Values parameters;
    for (const char* name : {"human.bone_codes", "human.error_codes", "human.density.weight"})
      parameters.push_back(training.model.store().value(graph, name));
    const Values found = differentiate(
        graph, sum_channels(graph.reshape(field.density, {1, field.density.elements()})), parameters);
    Executor run(training.device, graph, found);
    run.run();
    std::vector<double> sizes;
    for (const Value& gradient : found) {
      sizes.push_back(0);
      for (const float value : run.read(gradient)) sizes.back() += std::abs(value);
    }
    return sizes;
  };
  training.run(0, 3);  // codes start at 0, where E's last layer is 0, too
  const std::int64_t pictures = without.samples().ray_count();
  const std::vector<double> captured = gradients(pictures / 2), made_up = gradients(pictures);
  for (const double size : captured) CHECK(size > 0);
  CHECK(made_up[0] == 0);
  CHECK(made_up[1] == 0);
  CHECK(made_up[2] > 0);
}

TEST_CASE("human_trainer: the same seed gives the same bits") {
  Training a, b;
  a.run(0, 3);
  b.run(0, 3);
  CHECK(a.parameters() == b.parameters());
  CHECK(a.trainer.terms() == b.trainer.terms());
}

TEST_CASE(
    "human_trainer: a batch that does not fit is repeated, with the same result whenever it is noticed") {
  constexpr std::int64_t steps = 8;
  Training roomy(2), tight(1), late(1);
  roomy.run(0, steps);
  late.run(0, steps);
  for (std::int64_t step = 0; step < steps; ++step) {
    tight.run(step, step + 1);
    CHECK(std::isfinite(*tight.trainer.report(step + 1).loss));
  }
  CHECK(roomy.trainer.repeated_steps() == 0);
  CHECK(tight.trainer.repeated_steps() > 0);
  CHECK(tight.trainer.repeated_steps() < steps);
  CHECK(late.trainer.repeated_steps() == tight.trainer.repeated_steps());
  CHECK(late.parameters() == tight.parameters());
  CHECK(late.trainer.terms() == tight.trainer.terms());
  // Sums over more room round differently.
  const std::vector<float> a = tight.parameters(), b = roomy.parameters();
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(double(a[i]) - b[i]));
  CHECK(worst < 1e-4);
}

TEST_CASE("human_trainer: a synthetic walker is learned, as a held-out frame shows") {
  Training training;
  const Agreement before = agreement(training);
  CHECK(before.overlap < 0.4);
  CHECK(before.error > 2);
  training.run(0, 1);
  const double psnr_before = *training.trainer.report(1).psnr;
  training.run(1, training.trainer.steps());
  const StepReport last = training.trainer.report(training.trainer.steps());
  const double mean = last.more.at("colour");  // absolute error: its square is at most the mean square
  CHECK(*last.psnr > psnr_before + 6);
  CHECK(*last.psnr <= -20 * std::log10(mean));
  CHECK(*last.psnr >= -10 * std::log10(mean));  // colours differ by at most 1
  const Agreement after = agreement(training);
  CHECK(after.overlap > 0.8);
  CHECK(after.error < 1);
  CHECK(training.trainer.terms().at("mask") < 0.15);  // half of the rays see the person
  CHECK(training.trainer.terms().at("correction") > 0);
}
