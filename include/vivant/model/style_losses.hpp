#pragma once
#include <array>
#include <vector>

#include "vivant/model/stylizer.hpp"
#include "vivant/nn/vgg19.hpp"

namespace vivant {

/// Features of an image in the normalised VGG-19: relu1_1, 2_1, 3_1, 4_1, 5_1.
using StyleFeatures = std::array<Value, 5>;
/// The first `layers` of them; the others are absent.
StyleFeatures style_features(const Vgg19& vgg, Value image, std::size_t layers = 5);

/// Per layer one number for each channel by which errors are multiplied, 1 / sqrt(variance + 0.3 median
/// variance): without it a few rare channels decide everything.
using ChannelScales = std::array<std::vector<float>, 5>;
std::vector<float> channel_scale(const std::vector<double>& variance);

/// Weights of the reconstruction loss: 10 MSE + L1 + VGG.
struct ReconstructionWeights {
  double squared = 10, absolute = 1;
  std::array<double, 4> features = {0.02, 0.04, 0.04, 0.02};  ///< mean squared errors of relu1_1 to relu4_1
};

/// How far `image` is from `target`, and its VGG features from the target's; [1]. Absent features count
/// nothing.
Value reconstruction_loss(Value image, Value target, const StyleFeatures& image_features,
                          const StyleFeatures& target_features, const ReconstructionWeights& weights = {});

/// What the losses of stage 3 need of a style, computed once per style image.
struct StyleTarget {
  std::array<ChannelStatistics, 5> layers;
  StyleTokens tokens;               ///< the stylizer's own, unless they are trained
  Value features;                   ///< relu3_1 [h, w, C], where the tokens are trained (mirrored)
  std::array<StyleTokens, 2> deep;  ///< of relu4_1 and relu5_1, for the local targets
  Value colour_mean, colour_covariance;

  /// The stylizer's own tokens, recorded where they are trained.
  StyleTokens tokens_of(Graph& graph, const Stylizer& stylizer) const;
  /// All values in a fixed order; those that are absent are left out.
  Values values() const;
  /// Inputs of `graph` with the shapes of this target's values: one graph makes targets, another trains on
  /// them.
  StyleTarget as_inputs(Graph& graph) const;
};

/// rgb [H, W, 3] of the painting and its features.
StyleTarget style_target(Graph& graph, const Stylizer& stylizer, Value rgb, const StyleFeatures& features);

/// Weights of stage 3.
struct StyleWeights {
  double global = 100;      ///< mean and deviation of relu2_1 to relu5_1
  double first_layer = 10;  ///< the same of relu1_1
  double local = 1;         ///< the attention targets of relu3_1 to relu5_1
  double content = 0.5;     ///< normalised relu4_1 and relu5_1 of the content
  double colours = 20;      ///< mean and covariance of the colours
  double gamut = 100;       ///< colours outside of [0, 1]
};

/// The content's side of a step of stage 3.
struct StyleContent {
  Value luma;              ///< [H, W, 1]
  Value stylised;          ///< F_cs, the local target of relu3_1 unless the attention is trained
  StyleFeatures features;  ///< of the unstylised image; relu3_1 to relu5_1 are used
};

/// The single losses of stage 3, each [1] and unweighted.
struct StyleLosses {
  Value global, first_layer, local, content, colours, gamut;
  Value total(const StyleWeights& weights) const;
};

/// AdaAttN's global and local style losses with the additions above, for a stylised image [H, W, 3] and its
/// features.
StyleLosses style_losses(Graph& graph, const Stylizer& stylizer, Value image, const StyleFeatures& features,
                         const StyleContent& content, const StyleTarget& target, const ChannelScales& scales);

}  // namespace vivant
