#pragma once
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "vivant/graph/executor.hpp"
#include "vivant/nn/vgg19.hpp"

namespace vivant {

/// How near a picture is to a painting's style and to its own content, by the normalised VGG-19. Distances
/// are relative, averaged over relu1_1, 2_1, 3_1, 4_1 and 5_1; smaller is nearer.
struct StyleScore {
  double statistics =
      0;            ///< |[mean, deviation] - painting's| / |painting's|, by channel (AdaAttN's global loss)
  double gram = 0;  ///< the same of the Gram matrices (Gatys et al. 2016)
  double content =
      0;  ///< root mean squared difference of relu4_1, normalised by channel; sqrt(2): nothing in common
};

class StyleMeter {
 public:
  /// Of one painting, CV_8UC3 RGB. Device and network must outlive it.
  StyleMeter(Device& device, const Vgg19& vgg, cv::Mat painting);
  ~StyleMeter();

  /// The score of a picture that was made from `content`, both CV_8UC3 RGB of one size. The painting is
  /// brought to the picture's area, so that strokes of one size count alike.
  StyleScore score(const cv::Mat& picture, const cv::Mat& content);
  /// The same distances to the painting alone, for half of the work: `content` stays 0.
  StyleScore distance(const cv::Mat& picture);

 private:
  struct Network;
  struct Description;
  Description describe(const cv::Mat& picture);
  StyleScore distance(const Description& shown, cv::Size size);

  Device& device_;
  const Vgg19& vgg_;
  cv::Mat painting_;
  std::map<std::pair<int, int>, std::unique_ptr<Network>> networks_;       // by height and width
  std::map<std::pair<int, int>, std::unique_ptr<Description>> paintings_;  // by the same of the picture
};

}  // namespace vivant
