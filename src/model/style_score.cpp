#include "vivant/model/style_score.hpp"

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vivant/io/image.hpp"
#include "vivant/model/style_losses.hpp"
#include "vivant/ops/linear.hpp"

namespace vivant {
namespace {

/// |a - b| / |b|.
double relative_distance(const std::vector<float>& a, const std::vector<float>& b) {
  double difference = 0, length = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference += std::pow(static_cast<double>(a[i]) - b[i], 2);
    length += std::pow(static_cast<double>(b[i]), 2);
  }
  return std::sqrt(difference / length);
}

double root_mean_square(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < b.size(); ++i) sum += std::pow(static_cast<double>(a[i]) - b[i], 2);
  return std::sqrt(sum / static_cast<double>(b.size()));
}

/// A painting with as many pixels as a picture of this size; sides are multiples of 16.
cv::Mat of_area(const cv::Mat& painting, cv::Size size) {
  const double factor = std::sqrt(static_cast<double>(size.area()) / painting.size().area());
  const auto side = [&](int pixels) {
    return std::max(32, static_cast<int>(std::lround(pixels * factor / 16)) * 16);
  };
  cv::Mat result;
  cv::resize(painting, result, {side(painting.cols), side(painting.rows)}, 0, 0,
             factor < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  return result;
}

}  // namespace

struct StyleMeter::Network {
  Graph graph;
  Value picture, content;
  std::array<ChannelStatistics, 5> statistics;
  std::array<Value, 5> gram;
  std::unique_ptr<Executor> executor;
};

struct StyleMeter::Description {
  std::array<std::vector<float>, 5> statistics, gram;
  std::vector<float> content;
};

StyleMeter::StyleMeter(Device& device, const Vgg19& vgg, cv::Mat painting)
    : device_(device), vgg_(vgg), painting_(std::move(painting)) {}
StyleMeter::~StyleMeter() = default;

StyleMeter::Description StyleMeter::describe(const cv::Mat& picture) {
  std::unique_ptr<Network>& network = networks_[{picture.rows, picture.cols}];
  if (!network) {
    network = std::make_unique<Network>();
    network->picture = network->graph.input("picture", {picture.rows, picture.cols, 3});
    const StyleFeatures features = style_features(vgg_, network->picture);
    network->content = mean_variance_norm(features[3]);
    Values outputs = {network->content};
    for (int layer = 0; layer < 5; ++layer) {
      network->statistics[layer] = channel_statistics(features[layer]);
      network->gram[layer] = affine(outer_sum(features[layer], features[layer]),
                                    1.0 / static_cast<double>(features[layer].shape().rows()));
      outputs.insert(outputs.end(), {network->statistics[layer].mean, network->statistics[layer].deviation,
                                     network->gram[layer]});
    }
    network->executor = std::make_unique<Executor>(device_, network->graph, outputs);
  }
  cv::Mat values;
  picture.convertTo(values, CV_32F, 1.0 / 255);
  Executor& executor = *network->executor;
  executor.write(network->picture, floats_of(values));
  executor.run();
  Description description;
  for (int layer = 0; layer < 5; ++layer) {
    description.statistics[layer] = executor.read(network->statistics[layer].mean);
    const std::vector<float> deviation = executor.read(network->statistics[layer].deviation);
    description.statistics[layer].insert(description.statistics[layer].end(), deviation.begin(),
                                         deviation.end());
    description.gram[layer] = executor.read(network->gram[layer]);
  }
  description.content = executor.read(network->content);
  return description;
}

StyleScore StyleMeter::distance(const Description& shown, cv::Size size) {
  std::unique_ptr<Description>& style = paintings_[{size.height, size.width}];
  if (!style) style = std::make_unique<Description>(describe(of_area(painting_, size)));
  StyleScore score;
  for (int layer = 0; layer < 5; ++layer) {
    score.statistics += relative_distance(shown.statistics[layer], style->statistics[layer]) / 5;
    score.gram += relative_distance(shown.gram[layer], style->gram[layer]) / 5;
  }
  return score;
}

StyleScore StyleMeter::distance(const cv::Mat& picture) {
  return distance(describe(picture), picture.size());
}

StyleScore StyleMeter::score(const cv::Mat& picture, const cv::Mat& content) {
  if (picture.size() != content.size())
    fail("style score: picture and content have different sizes, {}x{} and {}x{}", picture.cols, picture.rows,
         content.cols, content.rows);
  const Description shown = describe(picture);
  StyleScore score = distance(shown, picture.size());
  score.content = root_mean_square(shown.content, describe(content).content);
  return score;
}

}  // namespace vivant
