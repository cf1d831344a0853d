#include "jobs/vgg_measurement.hpp"

#include "vivant/io/image.hpp"

namespace vivant {

VggMeasurement::VggMeasurement(Device& device, const Vgg19& vgg, int side) {
  picture_ = graph_.input("picture", {side, side, 3});
  const StyleFeatures features = style_features(vgg, picture_, 5);
  outputs_ = {features[2]};
  for (const Value& layer : features) {
    const ChannelStatistics statistics = channel_statistics(layer);
    outputs_.insert(outputs_.end(), {statistics.mean, statistics.deviation});
  }
  executor_ = std::make_unique<Executor>(device, graph_, outputs_);
}

std::vector<float> VggMeasurement::add(const cv::Mat& picture) {
  executor_->write(picture_, floats_of(picture));
  executor_->run();
  for (std::size_t layer = 0; layer < moments_.size(); ++layer) {
    const std::vector<float> mean = executor_->read(outputs_[1 + 2 * layer]),
                             deviation = executor_->read(outputs_[2 + 2 * layer]);
    Moments& moments = moments_[layer];
    moments.sum.resize(mean.size());
    moments.square.resize(mean.size());
    for (std::size_t c = 0; c < mean.size(); ++c) {
      moments.sum[c] += mean[c];
      moments.square[c] += mean[c] * mean[c] + deviation[c] * deviation[c];
    }
  }
  ++count_;
  return executor_->read(outputs_[0]);
}

std::vector<double> VggMeasurement::variance(int layer) const {
  const Moments& moments = moments_[layer];
  std::vector<double> result(moments.sum.size());
  for (std::size_t c = 0; c < result.size(); ++c)
    result[c] = moments.square[c] / count_ - (moments.sum[c] / count_) * (moments.sum[c] / count_);
  return result;
}

ChannelScales VggMeasurement::scales() const {
  ChannelScales scales;
  for (int layer = 0; layer < 5; ++layer) scales[layer] = channel_scale(variance(layer));
  return scales;
}

}  // namespace vivant
