#include "jobs/style_targets.hpp"

#include "vivant/io/image.hpp"

namespace vivant {
namespace {

constexpr int style_side = 256;
constexpr std::int64_t pool_size = 20, new_target_every = 8;
constexpr double recolour_paintings = 0.5;

}  // namespace

StyleTargets::StyleTargets(Device& device, const Stylizer& stylizer, const Vgg19& vgg,
                           const TrainingPictures& paintings, std::uint64_t seed)
    : paintings_(paintings), seed_(seed) {
  painting_ = graph_.input("painting", {style_side, style_side, 3});
  target_ = style_target(graph_, stylizer, painting_, style_features(vgg, painting_, 5));
  executor_ = std::make_unique<Executor>(device, graph_, target_.values());
  pool_.resize(pool_size);
}

void StyleTargets::make(std::int64_t number) {
  KeyedRandom random(seed_, "painting", number);
  executor_->write(painting_, floats_of(paintings_.crop(random, style_side, recolour_paintings)));
  executor_->run();
  std::vector<std::vector<float>>& values = pool_[number % pool_size];
  values.clear();
  for (const Value& value : target_.values()) values.push_back(executor_->read(value));
}

void StyleTargets::write(Executor& executor, const StyleTarget& inputs, KeyedRandom& random,
                         std::int64_t step) {
  const std::int64_t newest = pool_size + step / new_target_every;
  for (newest_ = std::max(newest_, newest - pool_size); newest_ < newest; ++newest_) make(newest_);
  const auto& values = pool_[random.below(pool_size)];
  const Values targets = inputs.values();
  for (std::size_t i = 0; i < targets.size(); ++i) executor.write(targets[i], values[i]);
}

StyleLosses losses_of_stylised(Graph& graph, const Stylizer& stylizer, const Vgg19& vgg, Value content,
                               Value rgb, const StyleFeatures& rgb_features,
                               const ContentStatistics& statistics, Value detail_amount,
                               const StyleTarget& target, const ChannelScales& scales) {
  const Value luma = stylizer.luma(graph, rgb);
  const Value stylised = stylizer.attend(graph, content, stylizer.feature_luma(luma),
                                         target.tokens_of(graph, stylizer), statistics);
  const Value detail = stylizer.options().detail ? multiply(stylizer.detail(luma), detail_amount) : Value{};
  const Value image = stylizer.decode_image(graph, stylised, detail);
  return style_losses(graph, stylizer, image, style_features(vgg, image, 5), {luma, stylised, rgb_features},
                      target, scales);
}

}  // namespace vivant
