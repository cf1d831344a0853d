#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "jobs/feature_step.hpp"
#include "small_capture.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/jobs/feature_trainer.hpp"
#include "vivant/jobs/style_trainer.hpp"

using namespace vivant;

namespace {

Config small_config(const std::string& hidden) {
  return load_config(
      "demo", std::nullopt,
      {"features.hidden=" + hidden, "scene.plane_size=16", "scene.unet_widths=[16, 32]", "scene.samples=8",
       "human.plane_size=16", "human.plane_channels=16", "human.unet_widths=[16, 32]",
       "human.render_step=0.03", "features.steps=12", "features.patch=48", "features.views=1",
       "style.steps=6", "style.crop=64", "style.novel_views=3"});
}

/// The model of the small capture, and how its parameters change.
struct Small {
  explicit Small(const std::string& hidden = "frozen") : config(small_config(hidden)) {}

  Config config;
  Device device;
  Progress progress{ProgressMode::none, false};
  CaptureModel model{device, config, small_capture()};

  std::unique_ptr<FeatureTrainer> feature_trainer(std::int64_t first_step) {
    return std::make_unique<FeatureTrainer>(device, config, small_capture(), model, progress, first_step);
  }
  std::unique_ptr<StyleTrainer> style_trainer() {
    return std::make_unique<StyleTrainer>(device, config, small_capture(), model, asset_path("styles"),
                                          progress);
  }

  std::map<std::string, std::vector<float>> parameters() {
    std::map<std::string, std::vector<float>> values;
    for (const ParameterStore::Parameter& parameter : model.store().parameters())
      values[parameter.name] = model.store().read(parameter.name);
    return values;
  }
  /// Runs the steps [first, steps); what the first and the last of them reported.
  template <typename Trainer>
  static std::pair<StepReport, StepReport> run(Trainer& trainer, std::int64_t steps, std::int64_t first = 0) {
    std::pair<StepReport, StepReport> reports;
    for (std::int64_t step = first; step < steps; ++step) {
      trainer.run(step);
      if (step == first) reports.first = trainer.report(first + 1);
    }
    reports.second = trainer.report(steps);
    CHECK_FALSE(trainer.failure());
    return reports;
  }
};

/// Runs the first half of the steps in `first`, hands all that a checkpoint keeps to `second`, and runs the
/// rest. `make` gives the trainer of a model from a step on.
template <typename Make>
void run_interrupted(Small& first, Small& second, std::int64_t steps, const Make& make) {
  Checkpoint checkpoint;
  Small::run(*make(first, 0), steps / 2);
  keep_training(checkpoint, first.model.store());
  restore_training(checkpoint, second.model.store());
  Small::run(*make(second, steps / 2), steps, steps / 2);
}

/// Checks that the parameters whose names start with one of `trained` changed, and no other one.
void check_changed(const std::map<std::string, std::vector<float>>& before,
                   const std::map<std::string, std::vector<float>>& after,
                   const std::vector<std::string>& trained) {
  for (const auto& [name, values] : after) {
    INFO(name);
    const bool expected = std::any_of(trained.begin(), trained.end(),
                                      [&, n = name](const std::string& part) { return n.starts_with(part); });
    CHECK((values != before.at(name)) == expected);
    CHECK(std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); }));
  }
}

std::unique_ptr<FeatureTrainer> features_from(Small& small, std::int64_t first_step) {
  return small.feature_trainer(first_step);
}

/// The feature error of a rendered view and its colours, in a patch in the middle.
std::pair<double, cv::Mat> seen(Small& small) {
  const FeatureView view =
      training_views(small.device, small.config, small_capture(), small.model, 1, small.progress).front();
  const Vgg19 vgg(small.device);
  FeatureStep step(small.device, small.config, small.model, vgg, 48, false, 1);
  step.run(view, padded_picture(small_capture().image(view.frame)), {8, 0, 48, 48}, 1,
           std::vector<double>(group_count, 0.0));
  small.model.store().clear_moments();
  return {step.losses().feature, view.rgb};
}

}  // namespace

TEST_CASE(
    "feature_trainer: feature layers and decoder learn, the fields are frozen, resumed with the same bits") {
  Small a, b, c;
  const auto before = a.parameters();
  const auto [first, last] = Small::run(*a.feature_trainer(0), a.config.features.steps);
  CHECK(*last.loss < 0.95 * *first.loss);  // one view, patches of nearly all of it
  const auto after = a.parameters();
  check_changed(before, after,
                {"scene.feature.", "human.feature.", "stylizer.psi", "stylizer.decoder", "content_norm."});

  run_interrupted(b, c, b.config.features.steps, features_from);
  CHECK(c.parameters() == after);
}

TEST_CASE("feature_trainer: hidden layers of features start as those of colours, alone learn, and help") {
  Small frozen, trained("trained"), b("trained"), c("trained");
  const std::int64_t steps = 40;
  for (Small* small : {&trained, &b, &c}) {
    small->config.features.steps = steps;
    small->config.features.rate = 0.003;
  }
  const auto before = trained.parameters();
  const cv::Mat colours = seen(trained).second;
  frozen.feature_trainer(0);
  const auto trainer = trained.feature_trainer(0);
  const auto start = trained.parameters();
  for (const auto& [name, values] : frozen.parameters()) CHECK(start.at(name) == values);
  for (const char* field : {"scene", "human"})
    for (const char* part : {"hidden.weight", "hidden.bias", "direction.weight"})
      CHECK(start.at(fmt::format("{}.feature_{}", field, part)) ==
            start.at(fmt::format("{}.{}", field, part)));

  Small::run(*trainer, steps);
  const auto after = trained.parameters();
  for (const auto* earlier : {&before, &start})
    check_changed(*earlier, after,
                  {"scene.feature", "human.feature", "stylizer.psi", "stylizer.decoder", "content_norm."});
  // Below the least-squares fit, which is the best of the frozen units.
  CHECK(seen(trained).first < 0.99 * seen(frozen).first);
  CHECK(cv::norm(colours, seen(trained).second, cv::NORM_INF) == 0);

  run_interrupted(b, c, steps, features_from);
  CHECK(c.parameters() == after);
}

TEST_CASE("patch_rays: a patch is that of the rendered view") {
  Small small("trained");
  const FeatureView view =
      training_views(small.device, small.config, small_capture(), small.model, 1, small.progress).front();
  Graph graph;
  const PatchRays rays(small.device, graph, small.config, small.model, 8);
  Executor executor(small.device, graph, {rays.hidden()});
  const cv::Rect patch(4, 2, 8, 8);
  rays.write(executor, view, patch);
  executor.run();
  const std::vector<float> hidden = executor.read(rays.hidden()), expected = patch_of(view.hidden, patch);
  REQUIRE(hidden.size() == expected.size());
  double person = 0, error = 0;
  for (std::size_t i = 0; i < hidden.size(); ++i) {
    if (i % 258 == 257) person = std::max<double>(person, hidden[i]);
    error = std::max<double>(error, std::abs(hidden[i] - expected[i]));
  }
  CHECK(person > 0.2);  // is in the patch
  CHECK(error < 1e-3);
}

TEST_CASE("style_trainer: psi and the decoder alone learn, with finite losses, resumed with the same bits") {
  Small a, b, c;
  for (Small* small : {&a, &b}) {
    Small::run(*small->feature_trainer(0), 1);
    small->model.store().clear_moments();
  }
  const auto before = a.parameters();
  const auto [first, last] = Small::run(*a.style_trainer(), a.config.style.steps);
  for (const auto& [name, loss] : last.more) CHECK(std::isfinite(loss));
  CHECK(last.more.at("global") > 0);
  CHECK_FALSE(first.psnr);  // the third step is the first one that reconstructs
  CHECK(*last.psnr > 10);
  CHECK(*last.psnr < 40);
  const auto after = a.parameters();
  check_changed(before, after, {"stylizer.psi", "stylizer.decoder"});

  run_interrupted(b, c, b.config.style.steps,
                  [](Small& small, std::int64_t) { return small.style_trainer(); });
  CHECK(c.parameters() == after);
}
