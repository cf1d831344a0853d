#include "vivant/jobs/train.hpp"

#include <functional>
#include <optional>

#include "jobs/training_pictures.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/feature_trainer.hpp"
#include "vivant/jobs/human_trainer.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/scene_trainer.hpp"
#include "vivant/jobs/style_trainer.hpp"
#include "vivant/model/composite_renderer.hpp"

namespace vivant {
namespace {

constexpr int least_painting_side = 64;

/// A stage of the training: the part of --stage that it belongs to, its name in checkpoints, and how it is
/// made.
struct Stage {
  std::string part, name;
  std::int64_t steps = 0;
  std::function<std::unique_ptr<StageTrainer>(std::int64_t first_step)> make;
};

/// The folder of paintings for stage style; throws when one of them cannot be read.
std::filesystem::path styles_of(const TrainOptions& options) {
  const std::filesystem::path folder = options.styles.empty() ? asset_path("styles") : options.styles;
  [[maybe_unused]] const TrainingPictures readable({folder}, least_painting_side, least_painting_side, {});
  return folder;
}

/// The run keeps the pictures that it trains on.
void copy_styles(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::filesystem::create_directories(to);
  for (const auto& entry : std::filesystem::directory_iterator(from))
    if (entry.is_regular_file()) std::filesystem::copy_file(entry.path(), to / entry.path().filename());
}

RunFolder open_run(const TrainOptions& options) {
  if (options.resume) return RunFolder::open_to_write(options.run);
  const Capture capture = load_capture(options.capture);  // first: bad input leaves no run behind
  const std::filesystem::path styles = styles_of(options);
  return RunFolder::create(options.run, to_toml(options.config), [&](const std::filesystem::path& folder) {
    copy_capture_essentials(capture, folder);
    copy_styles(styles, folder / "styles");
  });
}

std::size_t index_of(const std::vector<Stage>& stages, const std::string& name, const std::string& source) {
  for (std::size_t i = 0; i < stages.size(); ++i)
    if (stages[i].name == name) return i;
  fail("{}: the checkpoint's stage '{}' is not one of this run", source, name);
}

/// Prints or draws the first training graph; makes no run.
void show_plan(Device& device, const TrainOptions& options) {
  const Capture capture = load_capture(options.capture);
  CaptureModel model(device, options.config, capture);
  const DeviceCapture data(device, capture, capture.training_frames());
  SceneTrainer trainer(device, options.config, capture, data, model);
  trainer.run(0);
  if (options.print_plan) fmt::print("{}", trainer.executor().plan());
  if (!options.dot.empty()) write_text_file(options.dot, trainer.executor().dot());
}

/// What all stages need.
struct Training {
  Training(Device& device, const RunFolder& run, const Config& config, Progress& progress)
      : device(device),
        run(run),
        config(config),
        progress(progress),
        capture(load_capture(run.capture())),
        model(device, config, capture),
        data(device, capture, capture.training_frames()) {}

  std::vector<Stage> stages();
  /// After the scene's stage: its corrections stay, and the trainers of the later stages look at `corrected`.
  void see_corrections() { corrected = model.corrected(capture); }
  void run_stages(const std::string& part, bool resume);

  Device& device;
  const RunFolder& run;
  const Config& config;
  Progress& progress;
  const Capture capture;  ///< always the run's copy, so that a resumed run sees the same numbers
  CaptureModel model;
  Capture corrected;
  const DeviceCapture data;
};

std::vector<Stage> Training::stages() {
  std::vector<Stage> all = {{"reconstruct", "scene", config.scene.steps, [this](std::int64_t) {
                               return std::make_unique<SceneTrainer>(device, config, capture, data, model);
                             }}};
  if (model.human())
    all.push_back({"reconstruct", "human", config.human.steps, [this](std::int64_t) {
                     see_corrections();
                     return std::make_unique<HumanTrainer>(
                         device, config, corrected, model.store(), *model.human(),
                         render_backgrounds(device, model.scene(), corrected, data.frames()));
                   }});
  all.push_back({"features", "features", config.features.steps, [this](std::int64_t first_step) {
                   see_corrections();
                   return std::make_unique<FeatureTrainer>(device, config, corrected, model, progress,
                                                           first_step);
                 }});
  all.push_back({"style", "style", config.style.steps, [this](std::int64_t) {
                   see_corrections();
                   return std::make_unique<StyleTrainer>(device, config, corrected, model, run.styles(),
                                                         progress);
                 }});
  return all;
}

void Training::run_stages(const std::string& part, bool resume) {
  std::size_t current = 0;
  std::int64_t first_step = 0;
  const std::vector<Stage> all = stages();
  if (const auto newest = resume ? run.newest_checkpoint() : std::nullopt) {
    for (const std::string& damaged : newest->damaged) progress.warn(damaged);
    restore_training(newest->checkpoint, model.store());
    current = index_of(all, newest->checkpoint.stage, newest->checkpoint.source);
    first_step = newest->checkpoint.step;
    run.rewind_metrics(newest->checkpoint.stage, first_step);
  } else if (resume) {
    run.rewind_metrics("", 0);  // stopped before the first checkpoint: all over again
  }
  const InterruptGuard guard;
  TrainingState state{run, config, device, model.store()};
  std::string left_out;  // an earlier stage that is not done
  for (std::size_t s = 0; s < all.size(); ++s) {
    const Stage& stage = all[s];
    if (s > current) first_step = 0;
    const bool done = s < current || first_step >= stage.steps;
    const bool wanted = part == "all" || part == stage.part;
    if (!done && !wanted) left_out = stage.name;
    if (!done && wanted) {
      if (!left_out.empty())
        throw UsageError(fmt::format("stage {} needs stage {}, which is not done: leave --stage out",
                                     stage.name, left_out));
      if (s > current) model.store().clear_moments();
      run_stage(state, stage.name, *stage.make(first_step), first_step, progress);
    }
    state.steps_before += stage.steps;
  }
}

}  // namespace

void train(Device& device, const TrainOptions& options, Progress& progress) {
  if (options.print_plan || !options.dot.empty()) return show_plan(device, options);
  const RunFolder run = open_run(options);
  progress.record_in(run);
  const Config config = parse_run_config(read_whole_file(run.config()), run.config().string());
  Training(device, run, config, progress).run_stages(options.stage, options.resume);
}

}  // namespace vivant
