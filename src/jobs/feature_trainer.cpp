#include "vivant/jobs/feature_trainer.hpp"

#include <Eigen/Cholesky>

#include "jobs/feature_step.hpp"
#include "jobs/style_preview.hpp"
#include "jobs/vgg_measurement.hpp"
#include "vivant/io/image.hpp"
#include "vivant/jobs/psnr.hpp"

namespace vivant {
namespace {

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int measured_patches = 24;
constexpr double ridge = 1e-3;  // of the hidden units' mean square
constexpr std::int64_t warm_up = 10;
constexpr double rate_decay = 0.1;

/// The linear map [channels, 256] from hidden units [n, channels] to features [n, 256] of least squares.
class LeastSquares {
 public:
  explicit LeastSquares(std::int64_t channels)
      : xx_(Eigen::MatrixXd::Zero(channels, channels)),
        xy_(Eigen::MatrixXd::Zero(channels, Stylizer::features)) {}
  void add(const std::vector<float>& hidden, const std::vector<float>& features) {
    const auto rows = static_cast<Eigen::Index>(features.size()) / Stylizer::features;
    const Eigen::MatrixXd x = Eigen::Map<const Matrix>(hidden.data(), rows, xx_.rows()).cast<double>(),
                          y = Eigen::Map<const Matrix>(features.data(), rows, xy_.cols()).cast<double>();
    xx_ += x.transpose() * x;
    xy_ += x.transpose() * y;
  }
  Matrix solve() const {
    const double more = ridge * xx_.trace() / static_cast<double>(xx_.rows());
    const Eigen::MatrixXd regular = xx_ + more * Eigen::MatrixXd::Identity(xx_.rows(), xx_.rows());
    return regular.ldlt().solve(xy_).cast<float>();
  }

 private:
  Eigen::MatrixXd xx_, xy_;
};

/// Writes the rows of a field from `first` on into its feature layer.
void write_layer(ParameterStore& store, const Field& field, const Matrix& map, std::int64_t first) {
  const auto part = [&](std::int64_t row, std::int64_t rows) {
    return std::span<const float>(map.data() + row * map.cols(), static_cast<std::size_t>(rows * map.cols()));
  };
  store.write(field.name() + ".feature.weight", part(first, Field::hidden_width));
  store.write(field.name() + ".feature.bias", part(first + Field::hidden_width, 1));
}

/// Makes the features' hidden layer of a field that of its colours.
void copy_hidden(ParameterStore& store, const Field& field) {
  for (const char* part : {"hidden.weight", "hidden.bias", "direction.weight"})
    store.write(field.name() + ".feature_" + part, store.read(field.name() + "." + part));
}

/// With features.hidden = trained, at the start of the stage: before anything is rendered for features.
void copy_hidden(const Config& config, CaptureModel& model) {
  if (config.features.hidden != "trained") return;
  copy_hidden(model.store(), model.scene().field());
  if (model.human()) copy_hidden(model.store(), model.human()->field());
}

}  // namespace

struct FeatureTrainer::State {
  State(Device& device, const Config& config, const Capture& capture, CaptureModel& model, Progress& progress)
      : device(device),
        config(config),
        model(model),
        vgg(device),
        views(training_views(device, config, capture, model, config.features.views, progress)),
        side(patch_side(views.front(), config.features.patch)),
        step(device, config, model, vgg, side, true, 1) {
    for (const FeatureView& view : views) truths.push_back(padded_picture(capture.image(view.frame)));
  }
  std::size_t choose(KeyedRandom& random) const {
    return static_cast<std::size_t>(random.below(static_cast<std::int64_t>(views.size())));
  }

  Device& device;
  const Config& config;
  CaptureModel& model;
  Vgg19 vgg;
  std::vector<FeatureView> views;
  std::vector<cv::Mat> truths;
  int side;
  FeatureStep step;
};

FeatureTrainer::FeatureTrainer(Device& device, const Config& config, const Capture& capture,
                               CaptureModel& model, Progress& progress, std::int64_t first_step)
    : config_(config) {
  if (first_step == 0) copy_hidden(config, model);
  state_ = std::make_unique<State>(device, config, capture, model, progress);
  if (first_step == 0) start();
}
FeatureTrainer::~FeatureTrainer() = default;

/// The least-squares fit of the feature layers, and the statistics of what they give.
void FeatureTrainer::start() {
  State& s = *state_;
  VggMeasurement measurement(s.device, s.vgg, s.side);
  LeastSquares fit(hidden_channels(s.model));
  const auto seed = static_cast<std::uint64_t>(config_.training.seed);
  for (int i = 0; i < measured_patches; ++i) {
    KeyedRandom random(seed, "feature start", i);
    const std::size_t view = s.choose(random);
    const cv::Rect patch = random_patch(random, s.views[view], s.side);
    fit.add(hidden_patch_of(s.views[view], patch), measurement.add(s.truths[view](patch).clone()));
  }
  const Matrix map = fit.solve();
  write_layer(s.model.store(), s.model.scene().field(), map, 0);
  if (s.model.human()) write_layer(s.model.store(), s.model.human()->field(), map, Field::hidden_width + 1);
  s.model.content_norm().write(measured_norm(s.device, s.config, s.model, s.vgg, s.views));
}

void FeatureTrainer::run(std::int64_t step) {
  State& s = *state_;
  KeyedRandom random(static_cast<std::uint64_t>(config_.training.seed), "features", step);
  const std::size_t view = s.choose(random);
  std::vector<double> rates(group_count, 0.0);
  const RateSchedule schedule{steps(), warm_up, rate_decay};
  rates[group_heads] = schedule.rate(config_.features.rate, step);
  rates[group_style] = schedule.rate(config_.style.rate, step);
  const cv::Rect patch = random_patch(random, s.views[view], s.side);
  s.step.run(s.views[view], s.truths[view], patch, step + 1, rates);
}

StepReport FeatureTrainer::report(std::int64_t step) {
  const FeatureStep::Losses losses = state_->step.losses();
  return {.step = step,
          .loss = losses.total,
          .psnr = psnr_of(losses.rgb),
          .more = {{"feature", losses.feature}, {"vgg", losses.vgg}, {"rgb", losses.rgb}}};
}

std::optional<TrainingFailure> FeatureTrainer::failure() { return state_->step.failure(); }
void FeatureTrainer::diagnose(std::int64_t step) {
  run(step);
  state_->step.executor().run_checked();
}
const Executor& FeatureTrainer::executor() const { return state_->step.executor(); }

void FeatureTrainer::preview(const std::filesystem::path& folder, const std::string& stem) {
  State& s = *state_;
  const std::size_t shown = s.views.size() / 2;
  FeatureView view = s.views[shown];
  if (s.config.features.hidden == "trained") view.hidden = hidden_now(s.device, s.config, s.model, view);
  write_image(folder / (stem + ".png"),
              preview_sheet(
                  {s.truths[shown], view.rgb, stylised_view(s.device, s.config, s.model, s.vgg, view, {})}));
}

}  // namespace vivant
