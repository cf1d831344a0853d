#include "vivant/model/content_norm.hpp"

namespace vivant {
namespace {

constexpr double momentum = 0.02;
constexpr const char* names[] = {"content_norm.feature_mean", "content_norm.feature_deviation",
                                 "content_norm.luma_mean", "content_norm.luma_deviation"};

}  // namespace

RunningContentNorm::RunningContentNorm(ParameterStore& store) : store_(&store) {
  for (int i = 0; i < 4; ++i) {
    const std::int64_t channels = i < 2 ? Stylizer::features : 1;
    store.add(names[i], {channels}, 0, std::vector<float>(channels, i % 2 == 0 ? 0.0f : 1.0f));
  }
}

ContentStatistics RunningContentNorm::value(Graph& graph) const {
  const auto at = [&](int i) { return store_->value(graph, names[i]); };
  return {{at(0), at(1)}, {at(2), at(3)}};
}

void RunningContentNorm::update(const ContentStatistics& batch, Value stop) const {
  const ContentStatistics running = value(*batch.features.mean.graph);
  update_running_statistics(running.features, batch.features, momentum, stop);
  update_running_statistics(running.luma, batch.luma, momentum, stop);
}

ContentNorm RunningContentNorm::read() const {
  return {store_->read(names[0]), store_->read(names[1]), store_->read(names[2]), store_->read(names[3])};
}

void RunningContentNorm::write(const ContentNorm& norm) const {
  store_->write(names[0], norm.feature_mean);
  store_->write(names[1], norm.feature_deviation);
  store_->write(names[2], norm.luma_mean);
  store_->write(names[3], norm.luma_deviation);
}

}  // namespace vivant
