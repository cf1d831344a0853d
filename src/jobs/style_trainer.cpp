#include "vivant/jobs/style_trainer.hpp"

#include "jobs/feature_step.hpp"
#include "jobs/style_preview.hpp"
#include "jobs/style_targets.hpp"
#include "jobs/vgg_measurement.hpp"
#include "vivant/io/image.hpp"
#include "vivant/jobs/psnr.hpp"

namespace vivant {
namespace {

constexpr int measured_patches = 16, picture_side = 320, least_side = 64;
constexpr std::int64_t warm_up = 10, reconstruct_every = 3;
constexpr std::size_t shown_styles = 4;

bool reconstructs(std::int64_t step) { return step % reconstruct_every == reconstruct_every - 1; }

/// How VGG's layers vary over patches of the capture's pictures.
ChannelScales capture_scales(Device& device, const Config& config, const Vgg19& vgg,
                             const std::vector<FeatureView>& views, const std::vector<cv::Mat>& truths,
                             int side) {
  VggMeasurement measurement(device, vgg, side);
  for (int i = 0; i < measured_patches; ++i) {
    KeyedRandom random(static_cast<std::uint64_t>(config.training.seed), "style scales", i);
    const auto view = static_cast<std::size_t>(random.below(static_cast<std::int64_t>(truths.size())));
    measurement.add(truths[view](random_patch(random, views[view], side)).clone());
  }
  return measurement.scales();
}

}  // namespace

struct StyleTrainer::State {
  State(Device& device, const Config& config, const Capture& capture, CaptureModel& model,
        const std::filesystem::path& styles, Progress& progress);
  void record();

  Device& device;
  const Config& config;
  CaptureModel& model;
  Vgg19 vgg;
  TrainingPictures paintings;
  std::vector<FeatureView> views;  ///< the first ones have a truth
  std::vector<cv::Mat> truths;
  int side;
  StyleTargets targets;
  FeatureStep reconstruction;
  Graph graph;
  Value hidden, rendered;
  StyleTarget target;
  StyleLosses losses;
  Value total;
  std::unique_ptr<Optimizer> optimizer;
  std::unique_ptr<Executor> executor;
  bool stylised = false, reconstructed = false;  ///< whether a step of the kind was run
};

StyleTrainer::State::State(Device& device, const Config& config, const Capture& capture, CaptureModel& model,
                           const std::filesystem::path& styles, Progress& progress)
    : device(device),
      config(config),
      model(model),
      vgg(device),
      paintings({styles}, picture_side, least_side, {}),
      views(training_views(device, config, capture, model, config.features.views, progress)),
      side(patch_side(views.front(), config.style.crop)),
      targets(device, model.stylizer(), vgg, paintings, static_cast<std::uint64_t>(config.training.seed)),
      reconstruction(device, config, model, vgg, side, false, config.style.reconstruction_weight) {
  for (const FeatureView& view : views) truths.push_back(padded_picture(capture.image(view.frame)));
  if (config.style.novel_views > 0)
    for (FeatureView& view : novel_views(device, config, capture, model, config.style.novel_views, progress))
      views.push_back(std::move(view));
  record();
}

void StyleTrainer::State::record() {
  const Stylizer& stylizer = model.stylizer();
  hidden = graph.input("hidden", {side / Stylizer::scale, side / Stylizer::scale, hidden_channels(model)});
  rendered = graph.input("rendered", {side, side, 3});
  target = targets.as_inputs(graph);
  const Value content = stylizer.content(graph, rendered_features(graph, model, hidden));
  const Value whole = graph.constant({1}, std::vector<double>{1});
  losses = losses_of_stylised(graph, stylizer, vgg, content, rendered, style_features(vgg, rendered, 5),
                              model.content_norm().value(graph), whole, target,
                              capture_scales(device, config, vgg, views, truths, side));
  total = losses.total({.global = config.style.global_weight, .local = config.style.local_weight});
  Optimizer::Options options = adam_on(config, stylizer);
  options.stops_with = &reconstruction.optimizer();
  optimizer = optimise(device, graph, model.store(), total, options);
  executor = std::make_unique<Executor>(
      device, graph, Values{total, losses.global, losses.local, losses.content, losses.colours});
}

StyleTrainer::StyleTrainer(Device& device, const Config& config, const Capture& capture, CaptureModel& model,
                           const std::filesystem::path& styles, Progress& progress)
    : config_(config), state_(std::make_unique<State>(device, config, capture, model, styles, progress)) {}
StyleTrainer::~StyleTrainer() = default;

void StyleTrainer::run(std::int64_t step) {
  State& s = *state_;
  KeyedRandom random(static_cast<std::uint64_t>(config_.training.seed), "style", step);
  const auto choose = [&](std::size_t count) {
    return static_cast<std::size_t>(random.below(static_cast<std::int64_t>(count)));
  };
  std::vector<double> rates(group_count, 0.0);
  rates[group_style] =
      RateSchedule{steps(), warm_up, config_.style.rate_decay}.rate(config_.style.rate, step);
  (reconstructs(step) ? s.reconstructed : s.stylised) = true;
  if (reconstructs(step)) {
    const std::size_t view = choose(s.truths.size());
    s.reconstruction.run(s.views[view], s.truths[view], random_patch(random, s.views[view], s.side), step + 1,
                         rates);
    return;
  }
  const FeatureView& view = s.views[choose(s.views.size())];
  const cv::Rect patch = random_patch(random, view, s.side);
  s.executor->write(s.hidden, hidden_patch_of(view, patch));
  s.executor->write(s.rendered, patch_of(view.rgb, patch));
  s.targets.write(*s.executor, s.target, random, step);
  s.optimizer->set_step(*s.executor, step + 1, rates);
  s.executor->run();
}

StepReport StyleTrainer::report(std::int64_t step) {
  State& s = *state_;
  StepReport report;
  report.step = step;
  if (s.reconstructed) report.psnr = psnr_of(s.reconstruction.losses().rgb);
  if (!s.stylised) return report;
  const auto read = [&](Value value) -> double { return s.executor->read(value)[0]; };
  report.loss = read(s.total);
  report.more = {{"global", read(s.losses.global)},
                 {"local", read(s.losses.local)},
                 {"content", read(s.losses.content)},
                 {"colours", read(s.losses.colours)}};
  return report;
}

std::optional<TrainingFailure> StyleTrainer::failure() {
  return state_->optimizer->failure(*state_->executor);  // of either kind of step
}
void StyleTrainer::diagnose(std::int64_t step) {
  run(step);
  (reconstructs(step) ? state_->reconstruction.executor() : *state_->executor).run_checked();
}
const Executor& StyleTrainer::executor() const { return *state_->executor; }

void StyleTrainer::preview(const std::filesystem::path& folder, const std::string& stem) {
  State& s = *state_;
  const FeatureView& view = s.views[s.truths.size() / 2];
  std::vector<cv::Mat> pictures = {view.rgb};
  for (std::size_t i = 0; i < std::min(shown_styles, s.paintings.size()); ++i) {
    cv::Mat style;
    s.paintings[i].convertTo(style, CV_8U, 255);
    pictures.push_back(stylised_view(s.device, s.config, s.model, s.vgg, view, style));
  }
  write_image(folder / (stem + ".png"), preview_sheet(pictures));
}

}  // namespace vivant
