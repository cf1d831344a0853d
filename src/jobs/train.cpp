#include "vivant/jobs/train.hpp"

#include <functional>
#include <optional>

#include "vivant/io/atomic_file.hpp"
#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/human_trainer.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/scene_trainer.hpp"
#include "vivant/model/composite_renderer.hpp"

namespace vivant {
namespace {

/// A stage of the training: the part of --stage that it belongs to, its name in checkpoints, and how it is
/// made.
struct Stage {
  std::string part, name;
  std::int64_t steps = 0;
  std::function<std::unique_ptr<StageTrainer>()> make;
};

RunFolder open_run(const TrainOptions& options) {
  if (options.resume) return RunFolder::open_to_write(options.run);
  const Capture capture = load_capture(options.capture);  // first: a bad capture leaves no run behind
  return RunFolder::create(options.run, to_toml(options.config), [&](const std::filesystem::path& folder) {
    copy_capture_essentials(capture, folder);
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
  SceneTrainer trainer(device, options.config, capture, data, model.store(), model.scene());
  trainer.run(0);
  if (options.print_plan) fmt::print("{}", trainer.executor().plan());
  if (!options.dot.empty()) write_text_file(options.dot, trainer.executor().dot());
}

}  // namespace

void train(Device& device, const TrainOptions& options, Progress& progress) {
  if (options.print_plan || !options.dot.empty()) return show_plan(device, options);
  const RunFolder run = open_run(options);
  progress.record_in(run);
  // Always the run's copies, so that a resumed run sees the same numbers to the last bit.
  const Config config = parse_config("", read_whole_file(run.config()), run.config().string());
  const Capture capture = load_capture(run.capture());

  CaptureModel model(device, config, capture);
  const DeviceCapture data(device, capture, capture.training_frames());
  std::vector<Stage> stages = {
      {"reconstruct", "scene", config.scene.steps,
       [&] {
         return std::make_unique<SceneTrainer>(device, config, capture, data, model.store(), model.scene());
       }},
  };
  if (const HumanModel* human = model.human())
    stages.push_back({"reconstruct", "human", config.human.steps, [&, human] {
                        return std::make_unique<HumanTrainer>(
                            device, config, capture, model.store(), *human,
                            render_backgrounds(device, model.scene(), capture, data.frames()));
                      }});

  std::size_t current = 0;
  std::int64_t first_step = 0;
  if (options.resume) {
    if (const auto newest = run.newest_checkpoint()) {
      for (const std::string& damaged : newest->damaged) progress.warn(damaged);
      restore_training(newest->checkpoint, model.store());
      current = index_of(stages, newest->checkpoint.stage, newest->checkpoint.source);
      first_step = newest->checkpoint.step;
      run.rewind_metrics(newest->checkpoint.stage, first_step);
    } else {
      run.rewind_metrics("", 0);  // stopped before the first checkpoint: all over again
    }
  }
  const InterruptGuard guard;
  TrainingState state{run, config, device, model.store()};
  for (std::size_t s = 0; s < stages.size(); ++s) {
    const Stage& stage = stages[s];
    const bool wanted = options.stage == "all" || options.stage == stage.part;
    if (s >= current && wanted && (s > current || first_step < stage.steps)) {
      if (s > current) {
        first_step = 0;
        model.store().clear_moments();
      }
      const std::unique_ptr<StageTrainer> trainer = stage.make();
      run_stage(state, stage.name, *trainer, first_step, progress);
    }
    state.steps_before += stage.steps;
  }
}

}  // namespace vivant
