// Stage 3 of pretraining: the losses of AdaAttN, with photographs as content and paintings as styles.
#include "jobs/stylizer_training.hpp"
#include "vivant/ops/elementwise.hpp"

namespace vivant {
namespace {

constexpr int content_side = 128, style_side = 256;
constexpr std::int64_t pool_size = 20, new_target_every = 8;
constexpr double recolour_photographs = 0.2, recolour_paintings = 0.5, without_detail = 0.2;

}  // namespace

StyleStep::StyleStep(StylizerTraining& training) : training_(training) {
  const Stylizer& stylizer = training.stylizer;
  painting_ = target_graph_.input("painting", {style_side, style_side, 3});
  target_ = style_target(target_graph_, stylizer, painting_, style_features(training.vgg, painting_, 5));
  target_executor_ = std::make_unique<Executor>(training.device, target_graph_, target_.values());

  photograph_ = graph_.input("photograph", {content_side, content_side, 3});
  detail_amount_ = graph_.scalar("detail amount");
  target_inputs_ = target_.as_inputs(graph_);
  const StyleFeatures features = style_features(training.vgg, photograph_, 5);
  const Value luma = stylizer.luma(graph_, photograph_), small_luma = stylizer.feature_luma(luma);
  const Value content = stylizer.content(graph_, features[2]);
  const Value stylised = stylizer.attend(graph_, content, small_luma, target_inputs_.tokens,
                                         stylizer.statistics(content, small_luma));
  const Value image =
      stylizer.decode_image(graph_, stylised, multiply(stylizer.detail(luma), detail_amount_));
  const StyleLosses losses = style_losses(graph_, stylizer, image, style_features(training.vgg, image, 5),
                                          {luma, stylised, features}, target_inputs_, training.scales);
  losses_ = {losses.global, losses.first_layer, losses.local, losses.content, losses.colours, losses.gamut};
  optimizer_ = optimise(training, graph_, losses.total({}));
  executor_ = std::make_unique<Executor>(training.device, graph_, losses_);
}

/// The target `number` of the training replaces the one at `place` in the pool.
void StyleStep::make_target(std::int64_t number, std::size_t place) {
  KeyedRandom random(training_.seed, "painting", number);
  target_executor_->write(painting_,
                          values_of(training_.paintings.crop(random, style_side, recolour_paintings)));
  target_executor_->run();
  std::vector<std::vector<float>> values;
  for (const Value& value : target_.values()) values.push_back(target_executor_->read(value));
  pool_.resize(std::max(pool_.size(), place + 1));
  pool_[place] = std::move(values);
}

void StyleStep::run(std::int64_t step, std::int64_t optimizer_step, double rate) {
  // The pool after `step` steps is a function of the step alone, so that an interrupted training finds it
  // again.
  const std::int64_t newest = pool_size + step / new_target_every;
  if (pool_.empty())
    for (std::int64_t number = newest - pool_size; number < newest; ++number)
      make_target(number, number % pool_size);
  else if (step % new_target_every == 0)
    make_target(newest - 1, (newest - 1) % pool_size);

  KeyedRandom random(training_.seed, "style", step);
  executor_->write(photograph_,
                   values_of(training_.photographs.crop(random, content_side, recolour_photographs)));
  executor_->set(detail_amount_, random.chance(without_detail) ? 0 : 1);
  const auto& values = pool_[random.below(pool_size)];
  const Values inputs = target_inputs_.values();
  for (std::size_t i = 0; i < inputs.size(); ++i) executor_->write(inputs[i], values[i]);
  optimizer_->set_step(*executor_, optimizer_step, {rate});
  executor_->run();
}

std::array<double, 6> StyleStep::losses() {
  std::array<double, 6> result;
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = executor_->read(losses_[i])[0];
  return result;
}

}  // namespace vivant
