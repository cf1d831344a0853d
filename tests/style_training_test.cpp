#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "io_helpers.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/jobs/feature_trainer.hpp"
#include "vivant/jobs/style_trainer.hpp"
#include "vivant/jobs/synth.hpp"

using namespace vivant;

namespace {

const Capture& small_capture() {
  static const TemporaryFolder folder;
  static const Capture capture = [] {
    synthesise({.output = folder.path(), .frames = 9, .width = 64, .height = 48, .motion = {}});
    return load_capture(folder.path());
  }();
  return capture;
}

const Config& small_config() {
  static const Config config = load_config(
      "demo", std::nullopt,
      {"scene.plane_size=16", "scene.unet_widths=[16, 32]", "scene.samples=8", "human.plane_size=16",
       "human.plane_channels=16", "human.unet_widths=[16, 32]", "human.render_step=0.03", "features.steps=12",
       "features.patch=48", "features.views=1", "style.steps=6", "style.crop=64", "style.novel_views=3"});
  return config;
}

/// The model of the small capture, and how its parameters change.
struct Small {
  Device device;
  Progress progress{ProgressMode::none, false};
  CaptureModel model{device, small_config(), small_capture()};

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
/// rest.
template <typename Make>
void run_interrupted(Small& first, Small& second, std::int64_t steps, const Make& make) {
  Checkpoint checkpoint;
  Small::run(*make(first), steps / 2);
  keep_training(checkpoint, first.model.store());
  restore_training(checkpoint, second.model.store());
  Small::run(*make(second), steps, steps / 2);
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

}  // namespace

TEST_CASE(
    "feature_trainer: feature layers and decoder learn, the fields are frozen, resumed with the same bits") {
  Small a, b, c;
  const auto before = a.parameters();
  FeatureTrainer trainer(a.device, small_config(), small_capture(), a.model, a.progress);
  const auto [first, last] = Small::run(trainer, small_config().features.steps);
  CHECK(*last.loss < 0.95 * *first.loss);  // one view, patches of nearly all of it
  const auto after = a.parameters();
  check_changed(before, after,
                {"scene.feature.", "human.feature.", "stylizer.psi", "stylizer.decoder", "content_norm."});

  run_interrupted(b, c, small_config().features.steps, [](Small& small) {
    return std::make_unique<FeatureTrainer>(small.device, small_config(), small_capture(), small.model,
                                            small.progress);
  });
  CHECK(c.parameters() == after);
}

TEST_CASE("style_trainer: psi and the decoder alone learn, with finite losses, resumed with the same bits") {
  Small a, b, c;
  for (Small* small : {&a, &b}) {
    FeatureTrainer features(small->device, small_config(), small_capture(), small->model, small->progress);
    Small::run(features, 1);
    small->model.store().clear_moments();
  }
  const auto before = a.parameters();
  StyleTrainer trainer(a.device, small_config(), small_capture(), a.model, asset_path("styles"), a.progress);
  const auto [first, last] = Small::run(trainer, small_config().style.steps);
  for (const auto& [name, loss] : last.more) CHECK(std::isfinite(loss));
  CHECK(last.more.at("global") > 0);
  const auto after = a.parameters();
  check_changed(before, after, {"stylizer.psi", "stylizer.decoder"});

  run_interrupted(b, c, small_config().style.steps, [](Small& small) {
    return std::make_unique<StyleTrainer>(small.device, small_config(), small_capture(), small.model,
                                          asset_path("styles"), small.progress);
  });
  CHECK(c.parameters() == after);
}
