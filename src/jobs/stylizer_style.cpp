// Stage 3 of pretraining: the losses of AdaAttN, with photographs as content and paintings as styles.
#include "jobs/stylizer_training.hpp"
#include "vivant/io/image.hpp"

namespace vivant {
namespace {

constexpr int content_side = 128;
constexpr double recolour_photographs = 0.2, without_detail = 0.2;

}  // namespace

StyleStep::StyleStep(StylizerTraining& training)
    : training_(training),
      targets_(training.device, training.stylizer, training.vgg, training.paintings, training.seed) {
  const Stylizer& stylizer = training.stylizer;
  photograph_ = graph_.input("photograph", {content_side, content_side, 3});
  detail_amount_ = graph_.scalar("detail amount");
  target_ = targets_.as_inputs(graph_);
  const StyleFeatures features = style_features(training.vgg, photograph_, 5);
  const Value content = stylizer.content(graph_, features[2]),
              luma = stylizer.feature_luma(stylizer.luma(graph_, photograph_));
  const StyleLosses losses =
      losses_of_stylised(graph_, stylizer, training.vgg, content, photograph_, features,
                         stylizer.statistics(content, luma), detail_amount_, target_, training.scales);
  losses_ = {losses.global, losses.first_layer, losses.local, losses.content, losses.colours, losses.gamut};
  optimizer_ = optimise(training.device, graph_, training.store, losses.total(training.weights),
                        stylising_parts(training.stylizer));
  executor_ = std::make_unique<Executor>(training.device, graph_, losses_);
}

void StyleStep::run(std::int64_t step, std::int64_t optimizer_step, double rate) {
  KeyedRandom random(training_.seed, "style", step);
  executor_->write(photograph_,
                   floats_of(training_.photographs.crop(random, content_side, recolour_photographs)));
  executor_->set(detail_amount_, random.chance(without_detail) ? 0 : 1);
  targets_.write(*executor_, target_, random, step);
  optimizer_->set_step(*executor_, optimizer_step, {rate});
  executor_->run();
}

std::array<double, 6> StyleStep::losses() {
  std::array<double, 6> result;
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = executor_->read(losses_[i])[0];
  return result;
}

}  // namespace vivant
