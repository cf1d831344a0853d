#include "jobs/feature_step.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "vivant/io/image.hpp"
#include "vivant/ops/loss.hpp"

namespace vivant {
namespace {

constexpr int scale = Stylizer::scale;
constexpr double around_person = 0.5;

/// Where the person is among the features; empty without one.
cv::Rect person_window(const FeatureView& view) {
  const int alpha = 2 * (static_cast<int>(Field::hidden_width) + 1) - 1;
  if (view.hidden.channels() <= alpha) return {};
  cv::Mat person;
  cv::extractChannel(view.hidden, person, alpha);
  return cv::boundingRect(cv::Mat(person > 0.5));
}

cv::Rect in_features(const cv::Rect& patch) {
  return {patch.x / scale, patch.y / scale, patch.width / scale, patch.height / scale};
}

}  // namespace

int patch_side(const FeatureView& view, std::int64_t wanted) {
  const std::int64_t fits = std::min<std::int64_t>({wanted, view.rgb.rows, view.rgb.cols}) / 16 * 16;
  if (fits < 32) fail("pictures of {} x {} pixels are too small for VGG-19", view.rgb.cols, view.rgb.rows);
  return static_cast<int>(fits);
}

cv::Rect random_patch(KeyedRandom& random, const FeatureView& view, int side) {
  const int size = side / scale;
  const cv::Rect person = person_window(view);
  const bool aimed = random.chance(around_person) && !person.empty();
  const auto start = [&](int extent, int first, int length) {
    const int last = extent - size;
    const auto anywhere = static_cast<int>(random.below(last + 1));
    if (!aimed) return anywhere;
    return std::clamp(first + static_cast<int>(random.below(length)) - size / 2, 0, last);
  };
  const int x = start(view.hidden.cols, person.x, person.width),
            y = start(view.hidden.rows, person.y, person.height);
  return {scale * x, scale * y, side, side};
}

std::vector<float> patch_of(const cv::Mat& picture, const cv::Rect& patch) {
  const cv::Mat part = picture(patch).clone();
  const std::span<const float> values = floats_of(part);
  return {values.begin(), values.end()};
}

std::vector<float> hidden_patch_of(const FeatureView& view, const cv::Rect& patch) {
  return patch_of(view.hidden, in_features(patch));
}

Optimizer::Options adam_on(const Config& config, const Stylizer& stylizer) {
  return {.trained = {stylizer.name() + ".psi", stylizer.name() + ".decoder"},
          .groups = group_count,
          .adam = {.beta1 = config.training.adam_beta1, .beta2 = config.training.adam_beta2}};
}

FeatureStep::FeatureStep(Device& device, const Config& config, CaptureModel& model, const Vgg19& vgg,
                         int side, bool train_heads, double weight) {
  const Stylizer& stylizer = model.stylizer();
  const bool train_hidden = train_heads && config.features.hidden == "trained";
  if (train_hidden) rays_.emplace(device, graph_, config, model, side / scale);
  hidden_ = train_hidden ? rays_->hidden()
                         : graph_.input("hidden", {side / scale, side / scale, hidden_channels(model)});
  rendered_ = graph_.input("rendered", {side, side, 3});
  truth_ = graph_.input("truth", {side, side, 3});
  const StyleFeatures goal = style_features(vgg, truth_, 4);
  const Value features = rendered_features(graph_, model, hidden_);
  const Value content = stylizer.content(graph_, features), luma = stylizer.luma(graph_, rendered_);
  const Value image =
      stylizer.decode_image(graph_, content, stylizer.options().detail ? stylizer.detail(luma) : Value{});
  const StyleFeatures seen = style_features(vgg, image, 4);
  const Value feature_loss = l2_loss(features, goal[2]), rgb_loss = l2_loss(image, truth_);
  Value vgg_loss = l2_loss(seen[0], goal[0]);
  for (int layer = 1; layer < 4; ++layer) vgg_loss = add(vgg_loss, l2_loss(seen[layer], goal[layer]));
  const auto& weights = config.features;
  const Value loss =
      affine(add(add(affine(feature_loss, weights.feature_weight), affine(vgg_loss, weights.vgg_weight)),
                 affine(rgb_loss, weights.rgb_weight)),
             weight);
  losses_ = {feature_loss, vgg_loss, rgb_loss, loss};
  Optimizer::Options options = adam_on(config, stylizer);
  if (train_heads) options.trained.insert(options.trained.end(), {"scene.feature.", "human.feature."});
  if (train_hidden)
    options.trained.insert(options.trained.end(), {"scene.feature_hidden.", "scene.feature_direction.",
                                                   "human.feature_hidden.", "human.feature_direction."});
  optimizer_ = optimise(device, graph_, model.store(), loss, options);
  if (train_heads)
    model.content_norm().update(stylizer.statistics(content, stylizer.feature_luma(luma)),
                                optimizer_->status());
  executor_ = std::make_unique<Executor>(device, graph_, losses_);
}

void FeatureStep::run(const FeatureView& view, const cv::Mat& truth, const cv::Rect& patch,
                      std::int64_t optimizer_step, const std::vector<double>& rates) {
  if (rays_)
    rays_->write(*executor_, view, in_features(patch));
  else
    executor_->write(hidden_, hidden_patch_of(view, patch));
  executor_->write(rendered_, patch_of(view.rgb, patch));
  executor_->write(truth_, patch_of(truth, patch));
  optimizer_->set_step(*executor_, optimizer_step, rates);
  executor_->run();
}

FeatureStep::Losses FeatureStep::losses() {
  const auto read = [&](int i) -> double { return executor_->read(losses_[i])[0]; };
  return {read(0), read(1), read(2), read(3)};
}

}  // namespace vivant
