#pragma once
#include <string>
#include <vector>

#include "vivant/io/tensor_file.hpp"
#include "vivant/nn/parameters.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/mean_variance_norm.hpp"

namespace vivant {

/// How features are stylised; the first values are the shipped stylizer's. What goes beyond the paper can be
/// turned off.
struct StylizerOptions {
  /// Of query . key in the attention's logits; 1 in the paper. The less, the more tokens count for each
  /// feature: steadier from view to view, and without blotches.
  double feature_weight = 0.1;
  double luma_weight = 1;  ///< of -(L_c - L_s)^2 in the attention's logits; 0: features alone, as the paper
  double deviation_scale = 0.5;  ///< factor on S in S * norm(c) + M; 1 in the paper
  double norm_limit = 4;         ///< norm(c) is clamped to +-limit; 0: not clamped, as in the paper
  bool detail = true;            ///< the decoder also sees the detail of the rendered colours
  bool cosine = false;           ///< scores of AdaAttN's video variant; goes with luma_weight 0 alone
  /// AdaAttN's own network: neither phi nor psi, and a decoder that mirrors VGG-19's encoder. Goes with
  /// luma_weight 0 and without detail alone.
  bool mirrored = false;

  /// AdaAttN's own form.
  static StylizerOptions plain() {
    return {.feature_weight = 1,
            .luma_weight = 0,
            .deviation_scale = 1,
            .norm_limit = 0,
            .detail = false,
            .mirrored = true};
  }
  /// "guided": the shipped one; "plain"; "cosine": plain with the scores of AdaAttN's video variant. Throws
  /// UsageError for other names.
  static StylizerOptions of_form(const std::string& name);
  /// Such a name: the form that weights must have been trained in.
  std::string form() const;
};

/// What the attention reads of a style, computed once per style image.
struct StyleTokens {
  Value keys;    ///< [T, key channels]
  Value bias;    ///< [T], the luma term's part of the logits; absent without it
  Value values;  ///< [T, C]
};

/// Adds the luma term -weight (L_c - L_s)^2 to an attention: to keys [T, C], values [T, C] and the
/// standardised luma [T, 1] of a style. With weight 0 they stay as they are.
StyleTokens guided_tokens(Graph& graph, Value keys, Value values, Value luma, double weight);
/// The same for queries [..., C] with the standardised luma [..., 1] of the content.
Value guided_queries(Graph& graph, Value queries, Value luma, double weight);

/// What norm(c) subtracts and divides by. Given, never computed from the frame at hand: a video does not
/// flicker and tiles do not show.
struct ContentStatistics {
  ChannelStatistics features;  ///< [C] of phi(F_c)
  ChannelStatistics luma;      ///< [1] of the rendered luma at a quarter of the resolution

  Values values() const { return {features.mean, features.deviation, luma.mean, luma.deviation}; }
};

/// scale * S * normal + M (AdaAttN): M and S are what `queries` [..., key channels] find in the style, normal
/// is [..., C].
Value adaptive_normalisation(Value queries, Value normal, const StyleTokens& style,
                             const StylizerOptions& options);

/// from + amount (to - from), amount [1].
Value blend(Value from, Value to, Value amount);

/// F_cs = psi(AdaAttN(phi(F_c), F_s)) and the decoder (the paper's section "Stylizing the Scene"). F_c are
/// features in the space of VGG-19's relu3_1, activation-normalised, at a quarter of the image's resolution.
/// Parameters: stylizer.phi0, .phi1, .query, .key, .value, .psi0, .psi1 (fully connected) and .decoder0 to
/// .decoder3 (3x3), each with .weight and .bias; mirrored: .query, .key, .value and .decoder0 to .decoder4.
class Stylizer {
 public:
  static constexpr std::int64_t features = 256;   ///< C, of relu3_1
  static constexpr std::int64_t scale = 4;        ///< pixels of the image a feature
  static constexpr std::int64_t detail_halo = 4;  ///< pixels around a tile that decode reads
  static constexpr std::int64_t detail_channels = 2;

  /// Registers the parameters. Their first values stylise already: phi and value are the identity, query and
  /// key the same rotation; psi and the decoder need `start_read_out`, then training. Throws Error for
  /// options that do not go together.
  Stylizer(ParameterStore& store, const Initializer& initializer, StylizerOptions options = {},
           int group = 0);

  const StylizerOptions& options() const { return options_; }
  const std::string& name() const { return name_; }
  /// Features around a tile that decode reads.
  std::int64_t feature_halo() const { return options_.mirrored ? 3 : 2; }

  /// phi(F_c): [h, w, C] -> [h, w, C].
  Value content(Graph& graph, Value features) const;
  /// Luma of colours, [H, W, 3] -> [H, W, 1].
  Value luma(Graph& graph, Value rgb) const;
  /// Luma at a quarter of the resolution, [H, W, 1] -> [H/4, W/4, 1].
  Value feature_luma(Value luma) const;
  /// Two bands of detail, 4 (L - G1) and 4 (G1 - G2) with Gaussians G1 and G2: [H, W, 1] -> [H, W, 2].
  Value detail(Value luma) const;

  /// Keys, values and bias of a style: features [h, w, C] of the picture and its feature_luma [h, w, 1],
  /// which is not read with luma_weight 0.
  StyleTokens style_tokens(Graph& graph, Value features, Value luma) const;
  /// The statistics of one image: content = phi(F_c) [h, w, C], luma [h, w, 1].
  ContentStatistics statistics(Value content, Value luma) const;

  /// AdaAttN with given statistics: content = phi(F_c) [h, w, C], luma [h, w, 1] -> F_cs before psi, [h, w,
  /// C].
  Value attend(Graph& graph, Value content, Value luma, const StyleTokens& style,
               const ContentStatistics& statistics) const;

  /// psi and the decoder: features [h + 2n, w + 2n, C] with the halo n = feature_halo() and detail [4h + 8,
  /// 4w + 8, 2] with a halo of 4, or absent -> colours [4h, 4w, 3]. The mirrored decoder reads no detail.
  Value decode(Graph& graph, Value features, Value detail) const;
  /// The same for a whole image without halos: [h, w, C] and [4h, 4w, 2] -> [4h, 4w, 3]; beyond the borders
  /// the outermost values go on.
  Value decode_image(Graph& graph, Value features, Value detail) const;

  /// The whole way for a small image: features [h, w, C] and rgb [4h, 4w, 3] -> [4h, 4w, 3]. strength [1]
  /// blends F_cs with phi(F_c): 0 is `reconstruct`.
  Value stylise(Graph& graph, Value features, Value rgb, const StyleTokens& style,
                const ContentStatistics& statistics, Value strength) const;
  /// Without a style: the decoder on phi(F_c).
  Value reconstruct(Graph& graph, Value features, Value rgb) const;

 private:
  Value weight(Graph& graph, const std::string& layer) const;
  Value bias(Graph& graph, const std::string& layer) const;
  Value fully_connected(Graph& graph, const std::string& layer, Value x,
                        Activation activation = Activation::none) const;
  Value convolve(Graph& graph, const std::string& layer, Value x,
                 Activation activation = Activation::relu) const;
  Value decode_with_detail(Graph& graph, Value features, Value detail) const;
  Value decode_mirrored(Graph& graph, Value features) const;

  ParameterStore* store_;
  StylizerOptions options_;
  std::string name_ = "stylizer";
};

/// Copies the tensors of a stylizer file into an allocated store; throws Error when they were trained in
/// another form (a file that names none is guided), naming what is missing or has another shape.
void load_stylizer(ParameterStore& store, const Stylizer& stylizer, const TensorFile& file);
/// The parameters as tensors of a file, with the form as its metadata `form`.
TensorFile save_stylizer(const ParameterStore& store, const Stylizer& stylizer);

}  // namespace vivant
