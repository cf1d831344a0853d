#pragma once
#include <memory>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "vivant/data/camera.hpp"
#include "vivant/model/colour_match.hpp"
#include "vivant/model/stylizer.hpp"
#include "vivant/nn/vgg19.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// A rendered frame [H, W]: features [ceil(H/4), ceil(W/4), 256] and colours [H, W, 3].
struct RenderedFrame {
  std::span<const float> features, rgb;
};

/// The camera whose pixels are the features of the given one's picture: a quarter of the size, rounded up,
/// each pixel centre in the middle of 4 x 4 pixels.
Camera feature_camera(const Camera& camera);

/// ContentStatistics as numbers, on the host: means and deviations of features [C] and luma [1].
struct ContentNorm {
  std::vector<float> feature_mean, feature_deviation, luma_mean, luma_deviation;
};

/// A painting (CV_8UC3 RGB, of any size) and its share in a mixture of styles, above 0.
struct StylePicture {
  cv::Mat picture;
  double weight = 1;
};

/// The shares of the pictures in the mixture, which sum up to 1. Throws Error for a weight that is not above
/// 0.
std::vector<double> shares_of(std::span<const StylePicture> styles);

/// Stylises frames of one size in tiles, so that memory does not grow with the frame; tiles do not show.
class FrameStylizer {
 public:
  struct Options {
    int tile = 64;               ///< features a side, without the halo
    double feature_match = 1;    ///< how far features are moved to the stylised ones; above 1 beyond them
    double colour_match = 0.8;   ///< how far colours are moved to the painting's; 0: not, as the paper
    double detail_match = 1;     ///< how far detail is raised to the painting's; 0: not, as the paper
    std::int64_t tokens = 4096;  ///< of a style, at most

    /// Those of the stylizer's form: AdaAttN's own go without the matches of colours and detail.
    static Options of(const Stylizer& stylizer) {
      Options options;
      if (stylizer.options().mirrored) options.colour_match = options.detail_match = 0;
      return options;
    }
  };

  /// Device, stylizer and vgg must outlive it.
  FrameStylizer(Device& device, const Stylizer& stylizer, const Vgg19& vgg, int height, int width,
                const Options& options);
  ~FrameStylizer();

  /// The statistics of norm(c) over all these frames together.
  ContentNorm measure(std::span<const RenderedFrame> frames);
  /// The style from now on: one painting, or several whose AdaAttN means and deviations are mixed by their
  /// weights (only the ratios count). The matches of colours and detail come from `frames`, some of what will
  /// be stylised; like the statistics they are frozen until the next call.
  void set_style(std::span<const StylePicture> styles, const ContentNorm& norm,
                 std::span<const RenderedFrame> frames);
  void set_style(const cv::Mat& picture, const ContentNorm& norm, std::span<const RenderedFrame> frames);
  /// The same without matches of colours and detail, until `set_feature_match`.
  void set_style(std::span<const StylePicture> styles, const ContentNorm& norm);

  /// Another `Options::feature_match`, for later styles too; colours and detail are matched anew. Returns the
  /// frames in the style that was set, as `stylise` would.
  std::vector<std::vector<float>> set_feature_match(double match, std::span<const RenderedFrame> frames);
  /// Other statistics of norm(c) for the style that was set.
  void set_norm(const ContentNorm& norm);

  /// Colours [H, W, 3] in [0, 1]. strength blends from the reconstruction (0) to the style (1).
  std::vector<float> stylise(const RenderedFrame& frame, double strength = 1);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vivant
