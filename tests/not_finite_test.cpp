// A loss or gradient that is not finite stops a stage at the state before it: saved under its own step, equal
// to that of a training that ends there, and gone on from to the same end.
#include <functional>

#include "small_capture.hpp"
#include "vivant/io/image.hpp"
#include "vivant/jobs/feature_trainer.hpp"
#include "vivant/jobs/human_trainer.hpp"
#include "vivant/jobs/scene_trainer.hpp"
#include "vivant/jobs/style_trainer.hpp"
#include "vivant/model/composite_renderer.hpp"

using namespace vivant;

namespace {

constexpr int reported = 6, steps_before = 100;

/// A folder with one small painting.
const std::filesystem::path& painting() {
  static const TemporaryFolder folder;
  if (!std::filesystem::exists(folder / "painting.png")) {
    cv::Mat picture(64, 64, CV_8UC3);
    cv::randu(picture, 0, 255);
    write_image(folder / "painting.png", picture);
  }
  return folder.path();
}

/// Changes settings beyond what files may say, so that something overflows.
using Spoil = std::function<void(Config&)>;

Config small_config(const Spoil& spoil) {
  Config config =
      load_config("demo", std::nullopt,
                  {"scene.plane_size=16", "scene.unet_widths=[16, 16]", "scene.rays=64", "scene.samples=8",
                   "scene.batches_per_step=1", "human.plane_size=16", "human.plane_channels=16",
                   "human.unet_widths=[16, 16]", "human.rays=128", "human.batches_per_step=1",
                   "human.render_step=0.03", "human.sample_step=0.03", "human.box_points=64",
                   "features.patch=48", "features.views=1", "style.crop=64", "style.novel_views=0",
                   "training.preview_every=0", fmt::format("training.report_every={}", reported)});
  spoil(config);
  return config;
}

/// A new model, and the trainer of a stage for it.
struct Training {
  Training(const std::string& stage, const Spoil& spoil)
      : stage(stage), config(small_config(spoil)), model(device, config, small_capture()) {
    if (stage == "scene")
      trainer = std::make_unique<SceneTrainer>(device, config, small_capture(), data, model);
    else if (stage == "human")
      trainer = std::make_unique<HumanTrainer>(
          device, config, small_capture(), model.store(), *model.human(),
          render_backgrounds(device, model.scene(), small_capture(), data.frames()), 1);
    else if (stage == "features")
      trainer = std::make_unique<FeatureTrainer>(device, config, small_capture(), model, progress, 0);
    else
      trainer = std::make_unique<StyleTrainer>(device, config, small_capture(), model, painting(), progress);
  }
  /// What stops the stage.
  std::string error(const RunFolder& run, std::int64_t first) {
    const TrainingState state{run, config, device, model.store(), steps_before};
    return error_of([&] { run_stage(state, stage, *trainer, first, progress); });
  }
  Checkpoint kept() {
    Checkpoint checkpoint;
    keep_training(checkpoint, model.store());
    return checkpoint;
  }

  const std::string stage;
  Device device;
  Progress progress{ProgressMode::none, false};
  const Config config;
  CaptureModel model;
  const DeviceCapture data{device, small_capture(), small_capture().training_frames()};
  std::unique_ptr<StageTrainer> trainer;
};

void check_same(const Checkpoint& a, const Checkpoint& b) {
  REQUIRE(a.tensors.size() == b.tensors.size());
  for (const auto& [name, tensor] : a.tensors) {
    CAPTURE(name);
    CHECK(b.tensors.at(name).bytes == tensor.bytes);
  }
}

/// Returns the number of good steps.
std::int64_t check_stop(const std::string& stage, const Spoil& spoil) {
  const TemporaryFolder folder;
  Training stopped(stage, spoil), undisturbed(stage, spoil), resumed(stage, spoil);
  const RunFolder run = RunFolder::create(folder / "run", to_toml(stopped.config));
  const std::string message = stopped.error(run, 0);
  CAPTURE(message);
  const auto newest = run.newest_checkpoint();
  REQUIRE(newest);
  const std::int64_t good = newest->checkpoint.step;
  CHECK(good < reported - 1);
  CHECK(newest->checkpoint.stage == stage);
  CHECK(newest->number == steps_before + good);
  CHECK(message.starts_with("stage " + stage + ": the "));
  CHECK(contains(message, fmt::format("is not finite at step {}: the output of ", good + 1)));
  CHECK(contains(message, fmt::format("checkpoints/{:08}.safetensors holds", steps_before + good)));
  CHECK(contains(message, "vivant train --resume --run " + run.path().string()));

  for (std::int64_t step = 0; step < good; ++step) undisturbed.trainer->run(step);
  CHECK_FALSE(undisturbed.trainer->failure());
  check_same(newest->checkpoint, undisturbed.kept());

  restore_training(newest->checkpoint, resumed.model.store());
  CHECK(resumed.error(run, good) == message);
  const auto again = run.newest_checkpoint();
  CHECK(again->number == newest->number);
  check_same(newest->checkpoint, again->checkpoint);
  return good;
}

}  // namespace

TEST_CASE("not finite: the scene's and the person's training stop at the step before, bit for bit") {
  CHECK(check_stop("scene", [](Config& config) { config.scene.head_rate = 1e30; }) > 0);
  CHECK(check_stop("human", [](Config& config) { config.human.plane_rate = config.human.head_rate = 1e30; }) >
        0);
}

TEST_CASE("not finite: so does that of the features, with the running statistics") {
  CHECK(check_stop("features", [](Config& config) { config.features.rate = 1e30; }) > 0);
}

TEST_CASE("not finite: all steps of the style stage stop when one of its reconstructions fails") {
  CHECK(check_stop("style", [](Config& config) { config.style.reconstruction_weight = 1e39; }) == 2);
}
