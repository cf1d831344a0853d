#include "vivant/jobs/pose_fit.hpp"

#include "vivant/jobs/human_trainer.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/model/composite_renderer.hpp"

namespace vivant {
namespace {

constexpr std::int64_t report_every = 10;

/// The errors of colours and mask, the same for every run, and nothing to learn but codes.
Config config_of_fit(Config config, std::int64_t steps) {
  auto& human = config.human;
  human.steps = steps;
  human.colour_loss = "composite";
  human.mask_weight = 0.3;
  human.correction_weight = 3;
  human.code_rate = 0.01;
  human.plane_rate = human.unet_rate = human.head_rate = 0;
  human.warmup_steps = 0;
  human.rate_decay = 0.1;
  human.cooldown = 0;
  human.correction_start = -1;  // in full from the first step on
  human.alpha_weight = human.hard_weight = human.variation_weight = 0;
  human.smpl_weight = human.edge_weight = human.smooth_weight = 0;
  human.unseen_views = 0;  // these few frames miss much that the training frames show
  return config;
}

/// The held-out frames as if they were what is trained on.
Capture held_out_part(const Capture& capture) {
  Capture part = capture;
  part.frames.clear();
  for (const int index : capture.held_out_frames()) {
    part.frames.push_back(capture.frames[index]);
    part.frames.back().held_out = false;
  }
  return part;
}

/// A model with the run's fields whose codes are those of the held-out frames.
struct FittedPerson {
  ParameterStore store;
  HumanModel model;

  FittedPerson(Device& device, const OpenRun& run, const std::vector<int>& frames)
      : model(device, store, Initializer(0), run.model->human()->options(), run.model->human()->body().body(),
              static_cast<int>(frames.size())) {
    const HumanModel& trained = *run.model->human();
    std::vector<HumanModel::CodeRow> rows;
    rows.reserve(frames.size());
    for (const int frame : frames) rows.push_back(captured_state(trained, run.capture, frame).codes);
    store.allocate(device);
    for (const ParameterStore::Parameter& parameter : store.parameters())
      if (parameter.group != group_codes)
        store.write(parameter.name, run.model->store().read(parameter.name));
    model.write_codes(rows);
  }
};

}  // namespace

std::vector<HumanModel::CodeRow> fit_held_out_codes(Device& device, const OpenRun& run, std::int64_t steps,
                                                    Progress& progress) {
  const std::string name = run.folder.path().string();
  const HumanModel* human = run.model->human();
  if (!human) fail("{} has no person whose poses could be fitted", name);
  if (!human->options().bone_corrections && !human->options().error_correction)
    fail("{} learns no corrections of poses, so that none can be fitted", name);
  const Config config = config_of_fit(run.config, steps);
  const Capture capture = held_out_part(run.capture);
  FittedPerson person(device, run, run.capture.held_out_frames());
  HumanTrainer trainer(device, config, capture, person.store, person.model,
                       render_backgrounds(device, run.model->scene(), capture, capture.training_frames()));
  progress.begin("poses", 0, steps);
  for (std::int64_t step = 0; step < steps; ++step) {
    trainer.run(step);
    if (interrupted()) throw Interrupted("stopped while poses were fitted");
    if ((step + 1) % report_every != 0 && step + 1 < steps) continue;
    progress.report(trainer.report(step + 1));
    if (const auto failure = trainer.failure()) fail("poses cannot be fitted: {}", failure->what);
  }
  progress.end();
  std::vector<HumanModel::CodeRow> codes;
  codes.reserve(capture.frames.size());
  for (int row = 0; row < static_cast<int>(capture.frames.size()); ++row)
    codes.push_back(person.model.mixed_codes({{row, 1.0}}));
  return codes;
}

}  // namespace vivant
