#include "vivant/jobs/human_trainer.hpp"

#include <algorithm>

#include "vivant/io/image.hpp"
#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/psnr.hpp"

namespace vivant {

HumanRayOptions human_ray_options(const Config& config, bool exact_poses) {
  return {.border = config.human.ray_border,
          .mask_softness = exact_poses ? 0 : config.human.mask_softness,
          .unseen_views = static_cast<int>(config.human.unseen_views),
          .pool = {.step = config.human.sample_step,
                   .threshold = config.human.threshold,
                   .samples_per_ray = config.human.samples}};
}

HumanTrainer::HumanTrainer(Device& device, const Config& config, const Capture& capture,
                           ParameterStore& store, const HumanModel& model,
                           const std::vector<cv::Mat>& backgrounds, double room)
    : device_(device),
      config_(config),
      capture_(capture),
      store_(store),
      model_(model),
      rays_(device, model.body(), capture, capture.training_frames(), backgrounds,
            human_ray_options(config, capture.human && capture.human->exact)),
      points_(device, model, static_cast<std::uint64_t>(config.training.seed)) {
  const std::int64_t rays = config.human.rays * config.human.batches_per_step;
  most_samples_ = rays * rays_.samples().samples_per_ray();
  // The sum over many random rays stays near its mean.
  const double usual_samples = rays_.mean_samples() * static_cast<double>(rays);
  capacity_ = std::min(most_samples_, 1 + static_cast<std::int64_t>(room * usual_samples));
  usual_ = make_step(capacity_);
}

std::unique_ptr<HumanStep> HumanTrainer::make_step(std::int64_t capacity) {
  return std::make_unique<HumanStep>(device_, config_, store_, model_, rays_, points_, capacity);
}

void HumanTrainer::run(std::int64_t step) {
  larger_.reset();
  if (reported_step_ < 0) reported_step_ = step;
  usual_->run(step);
  last_step_ = step;
}

void HumanTrainer::repeat_overflowed_steps() {
  while (!failure_) {
    const std::optional<std::int64_t> overflowed = usual_->optimizer().overflowed_step(usual_->executor());
    if (!overflowed) return;
    // From the usual capacity on again in every such step: what a step gives does not depend on earlier ones,
    // so that a resumed run computes the same.
    const std::int64_t step = *overflowed - 1;
    std::int64_t capacity = capacity_;
    do {
      capacity = std::min(2 * capacity, most_samples_);
      larger_ = make_step(capacity);
      larger_->run(step);
    } while (larger_->optimizer().overflowed_step(larger_->executor()));
    failure_ = larger_->optimizer().failure(larger_->executor());
    if (failure_) return;
    ++repeated_steps_;
    usual_->optimizer().clear_status(device_);
    const std::int64_t last = last_step_;
    for (std::int64_t skipped = step + 1; skipped <= last; ++skipped) run(skipped);
  }
}

HumanStep& HumanTrainer::latest() {
  repeat_overflowed_steps();
  return larger_ ? *larger_ : *usual_;
}

StepReport HumanTrainer::report(std::int64_t step) {
  StepReport report;
  report.step = step;
  report.loss = latest().loss();
  report.psnr = psnr_of(latest().squared_error());
  report.rays =
      static_cast<double>((step - reported_step_) * config_.human.rays * config_.human.batches_per_step);
  reported_step_ = step;
  report.more = latest().terms();
  return report;
}

std::optional<TrainingFailure> HumanTrainer::failure() {
  repeat_overflowed_steps();
  return failure_ ? failure_ : usual_->optimizer().failure(usual_->executor());
}

void HumanTrainer::diagnose(std::int64_t step) {
  latest().run(step);
  latest().executor().run_checked();
}

void HumanTrainer::preview(const std::filesystem::path& folder, const std::string& stem) {
  const std::vector<int> held_out = capture_.held_out_frames();
  const int frame = held_out.empty() ? 0 : held_out.front();
  HumanRenderer renderer(device_, model_, human_renderer_options(config_, true));
  cv::Mat picture = capture_.image(frame), person(picture.size(), CV_8UC3, cv::Scalar::all(128));
  renderer.render(capture_.frames[frame].camera, captured_state(model_, capture_, frame)).draw_over(person);
  cv::hconcat(picture, person, picture);
  write_image(folder / (stem + ".png"), picture);
}

}  // namespace vivant
