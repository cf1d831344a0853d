#include "vivant/jobs/pretrain_stylizer.hpp"

#include "jobs/stylizer_preview.hpp"
#include "jobs/stylizer_training.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/psnr.hpp"
#include "vivant/jobs/stage.hpp"

namespace vivant {
namespace {

constexpr double inversion_decay = 0.1, style_decay = 0.05;  // of the rates, until the stage's end
constexpr std::int64_t warm_up = 20, report_every = 10, save_every = 100, checkpoints_kept = 2;
constexpr double reconstruction_in_style = 8;  // weight of the reconstruction between the steps of stage 3

/// Learning rates of the stages. The mirrored decoder's first layer has nine times psi's inputs: at psi's
/// rate its ReLUs die.
struct Rates {
  double inversion, style;
};
Rates rates_of(const Stylizer& stylizer) {
  return stylizer.options().mirrored ? Rates{1e-4, 1e-4} : Rates{2e-3, 3e-4};
}

/// What a run must agree in to be gone on with.
std::string description(const PretrainStylizerOptions& options) {
  const StylizerOptions form = StylizerOptions::of_form(options.form);
  return fmt::format(
      "seed = {}\ninversion_steps = {}\ninversion_decay = {}\nstyle_steps = {}\nstyle_decay = {}\n"
      "feature_weight = {}\nluma_weight = {}\nglobal_weight = {}\nreconstruction_weight = {}\n{}",
      options.seed, options.inversion_steps, inversion_decay, options.style_steps, style_decay,
      form.feature_weight, form.luma_weight, options.global_weight, reconstruction_in_style,
      options.form == "guided" ? "" : fmt::format("form = \"{}\"\n", options.form));
}

class Pretraining {
 public:
  Pretraining(Device& device, const PretrainStylizerOptions& options, const RunFolder& run,
              Progress& progress)
      : options_(options),
        run_(run),
        progress_(progress),
        training_(device, options),
        rates_(rates_of(training_.stylizer)) {}

  void run() {
    const auto newest = run_.newest_checkpoint();
    if (newest) restore(newest->checkpoint);
    const double psnr = measure_pictures(training_, !newest);
    if (!newest) progress_.info(fmt::format("least-squares read-out: {:.1f} dB", psnr));
    if (stage_ == "inversion") invert();
    stylise();
    TensorFile file = save_stylizer(training_.store, training_.stylizer);
    file.metadata["training"] = description(options_);
    write_safetensors(options_.output, file);
  }

 private:
  void invert() {
    InversionStep step(training_, 1);
    progress_.begin("inversion", step_, options_.inversion_steps);
    double average = 0;
    for (std::int64_t i = step_; i < options_.inversion_steps; ++i) {
      step.run(i, i + 1,
               RateSchedule{options_.inversion_steps, warm_up, inversion_decay}.rate(rates_.inversion, i));
      average += step.error() / report_every;
      if ((i + 1) % report_every == 0) {
        check(step.failure());
        progress_.report({.step = i + 1, .psnr = psnr_of(average)});
        average = 0;
      }
      after("inversion", i + 1, options_.inversion_steps);
    }
    progress_.end();
    write_preview(training_, run_.previews() / "inversion.png", false);
    stage_ = "style";
    step_ = 0;
    training_.store.clear_moments();
    save("style", 0);
  }

  /// Steps of the style losses and of the reconstruction take turns.
  void stylise() {
    if (options_.style_steps == 0) return;
    StyleStep style(training_);
    InversionStep reconstruction(training_, reconstruction_in_style);
    progress_.begin("style", step_, options_.style_steps);
    for (std::int64_t i = step_; i < options_.style_steps; ++i) {
      const double rate = RateSchedule{options_.style_steps, warm_up, style_decay}.rate(rates_.style, i);
      if (i % 3 == 2)
        reconstruction.run(options_.inversion_steps + i, i + 1, rate);
      else
        style.run(i, i + 1, rate);
      if ((i + 1) % report_every == 0) {
        check(style.failure());
        check(reconstruction.failure());
        const std::array<double, 6> losses = style.losses();
        progress_.report({.step = i + 1,
                          .loss = losses[0],
                          .psnr = psnr_of(reconstruction.error()),
                          .more = {{"global", losses[0]},
                                   {"first_layer", losses[1]},
                                   {"local", losses[2]},
                                   {"content", losses[3]},
                                   {"colours", losses[4]},
                                   {"gamut", losses[5]}}});
      }
      after("style", i + 1, options_.style_steps);
    }
    progress_.end();
    write_preview(training_, run_.previews() / "style.png", true);
  }

  static void check(const std::optional<TrainingFailure>& failure) {
    if (failure) fail("{}: start again with another seed", failure->what);
  }

  void after(const std::string& stage, std::int64_t done, std::int64_t steps) {
    const bool stopped = interrupted() && done < steps;
    if (stopped || done % save_every == 0) save(stage, done);
    if (!stopped) return;
    progress_.end();
    throw Interrupted(fmt::format(
        "stopped at step {} of {} of stage {}; the same command with --resume goes on", done, steps, stage));
  }

  void save(const std::string& stage, std::int64_t step) const {
    Checkpoint checkpoint;
    checkpoint.stage = stage;
    checkpoint.step = step;
    checkpoint.seed = options_.seed;
    checkpoint.config = description(options_);
    checkpoint.device_class = training_.device.device_class() == DeviceClass::cpu ? "cpu" : "gpu";
    checkpoint.precision = "single";
    keep_training(checkpoint, training_.store);
    run_.save(checkpoint, step + (stage == "style" ? options_.inversion_steps : 0), checkpoints_kept);
  }

  void restore(const Checkpoint& checkpoint) {
    if (checkpoint.config != description(options_))
      throw UsageError(
          fmt::format("{} was begun with other settings: resume with the same, or use a new folder",
                      run_.path().string()));
    restore_training(checkpoint, training_.store);
    stage_ = checkpoint.stage;
    step_ = checkpoint.step;
    run_.rewind_metrics(stage_, step_);
  }

  const PretrainStylizerOptions& options_;
  const RunFolder& run_;
  Progress& progress_;
  StylizerTraining training_;
  const Rates rates_;
  std::string stage_ = "inversion";
  std::int64_t step_ = 0;
};

}  // namespace

void pretrain_stylizer(Device& device, const PretrainStylizerOptions& options, Progress& progress) {
  const InterruptGuard guard;
  const RunFolder run = options.resume ? RunFolder::open_to_write(options.run)
                                       : RunFolder::create(options.run, description(options));
  progress.record_in(run);
  Pretraining(device, options, run, progress).run();
}

}  // namespace vivant
