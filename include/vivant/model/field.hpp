#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "vivant/nn/unet.hpp"
#include "vivant/ops/triplane.hpp"

namespace vivant {

/// Where the features of a field's points come from (the paper and its ablations).
enum class Encoding {
  full,      ///< tri-planes from U-Nets on the encoded voxels of the whole box: the paper
  occupied,  ///< the same, the voxels near sparse points or the body's surface alone
  vanilla,   ///< tri-planes optimised directly
  mlp        ///< no planes: the original NeRF's perceptron on encoded points
};

std::string_view name_of(Encoding encoding);
/// Throws UsageError for an unknown name.
Encoding encoding_from(const std::string& name);

struct FieldOptions {
  Encoding encoding = Encoding::full;
  Combine combine = Combine::product;
  std::int64_t plane_size = 128;  ///< H_p = W_p, a multiple of 2^(levels - 1)
  std::int64_t channels = 32;     ///< C of the planes
  int scales = 1;  ///< of vanilla planes: they are a sum of planes of this size, half of it, ... enlarged
  int gradient_copies = 2;  ///< private copies of the planes' gradient, on CPUs
  std::vector<std::int64_t> unet_widths = {32, 64, 128, 256};
  int position_frequencies = 6;   ///< L of gamma_v
  int direction_frequencies = 4;  ///< L of gamma_d; 0: no view dependence
  bool shading = false;           ///< hidden units depend on the way that the surface faces, see Facing
  Activation density_activation = Activation::truncated_exp;
  double density_bias = -1.5;
  int mlp_layers = 8, mlp_width = 256;  ///< for Encoding::mlp
  bool feature_hidden = false;          ///< features have a hidden layer of their own
};

/// Learning-rate groups of a model's parameters.
enum ParameterGroup : int {
  group_planes = 0,
  group_heads = 1,
  group_codes = 2,
  group_style = 3,
  group_cameras = 4,
  group_exposures = 5,
  group_count = 8  ///< more than there are: rates are set at once, as 1, 2, 4, 8 or 16 numbers
};

/// What is made of the hidden units that rays see.
enum class Output {
  colour,   ///< [R, 3]
  feature,  ///< [R, 256], in the space of VGG-19's relu3_1
  hidden    ///< [R, 129] of a field: the units of features and alpha, in which features are linear
};

/// What the hidden units depend on beside a point's features; all of it may be absent. R rays or points.
struct Facing {
  Value directions;    ///< [R, 3] of the views
  Value keep = {};     ///< [R, 1] multiplied with the encoded directions: 0 drops a direction
  Value normals = {};  ///< [R, 3] of the surface as it is observed, for FieldOptions::shading
};

/// What the hidden units of N samples are made of: relu(x w + term).
struct UnitInputs {
  Value x;          ///< [N, K]
  Value w;          ///< [K, 128]
  Value term;       ///< [128], or [R, 128] where row r serves the samples of ray r
  Value rows = {};  ///< i32 [R, S] the row of a sample, -1 where there is none; absent: N = R S, as they lie
};
/// The units themselves, [N, 128]; a term of rays needs N = R S.
Value hidden_units(const UnitInputs& inputs);
/// The units times `weight` [R, S], summed over each ray: [R, 128]. Samples that weigh less than `threshold`
/// are left out, with 0 none: with 1e-4 and 128 samples at most 0.0128 of a hidden unit's largest value is
/// lost. With `rows`, w and term alone have gradients: asking for those of samples fails.
Value rendered_units(const UnitInputs& inputs, Value weight, double threshold);

/// A radiance field on geometry-guided tri-planes: points in [-1, 1]^3 to density and
/// to 128 hidden units, which are rendered before the last linear layer is applied (render, then project:
/// exact, since that layer is linear and its bias is multiplied by the accumulated alpha).
///
/// Parameters: `<name>.unet_xy|xz|yz...` or `<name>.planes` (and `planes2`, `planes4`, ...),
/// `<name>.density`, `<name>.hidden`,
/// `<name>.direction`, `<name>.colour`, `<name>.feature`; with FieldOptions::feature_hidden
/// `<name>.feature_hidden` and `<name>.feature_direction`, which take the place of the hidden layer's for
/// every output but colours.
class Field {
 public:
  static constexpr std::int64_t hidden_width = 128;
  static constexpr std::int64_t feature_width = 256;

  /// `occupied_points`: points in [-1, 1]^3, needed by Encoding::occupied alone.
  Field(Device& device, ParameterStore& store, const Initializer& initializer, std::string name,
        const FieldOptions& options, std::vector<float> occupied_points = {});

  /// The planes [3, size, size, C]; an absent value for Encoding::mlp. They depend on the parameters alone:
  /// baked when rendering. `size` is 0 for the options' plane_size, or another that the U-Nets can take:
  /// training starts with small planes, which learn fastest at first.
  Value planes(Graph& graph, std::int64_t size = 0) const;
  /// Features of points [N, 3] -> [N, C].
  Value features(Graph& graph, Value planes, Value points) const;
  /// Density before the activation, [N, 1].
  Value density_logit(Graph& graph, Value features) const;
  Value density(Graph& graph, Value features) const {
    return activate(density_logit(graph, features), options_.density_activation);
  }
  /// The hidden layer where all samples of a ray share its facing, which then is a term of the R rays.
  /// `output`, here and below: what the hidden units are for, which says whose layer is used.
  UnitInputs units_of_rays(Graph& graph, Value features, const Facing& facing,
                           Output output = Output::colour) const;
  /// The same layer where every sample has a facing of its own: x holds its features, encoded direction and
  /// normal side by side, as far as there are any.
  UnitInputs units_of_samples(Graph& graph, Value features, const Facing& facing,
                              Output output = Output::colour) const;
  /// Rendered hidden units [R, 128] and alpha [R, 1] -> colours [R, 3] or features [R, 256].
  Value colour(Graph& graph, Value hidden, Value alpha) const;
  Value feature(Graph& graph, Value hidden, Value alpha) const;
  /// One of them, or [R, 129] when the hidden units themselves are asked for.
  Value output(Graph& graph, Output output, Value hidden, Value alpha) const;

  const FieldOptions& options() const { return options_; }
  const std::string& name() const { return name_; }

 private:
  /// What a facing adds to the hidden layer's inputs [R, K] and the rows of the weight [K, 128] that it
  /// meets; both absent when nothing is given.
  struct FacingInputs {
    Value x, weight;
  };
  FacingInputs facing_inputs(Graph& graph, const Facing& facing, Output output) const;
  /// Columns of the encoded directions of views.
  std::int64_t direction_width() const;
  bool own_hidden(Output output) const { return options_.feature_hidden && output != Output::colour; }
  const LinearLayer& hidden_layer(Output output) const;
  /// The sum of all scales. Coarse scales learn what fine ones see too seldom. (Planes below each other are
  /// enlarged as one picture: their borders mix, which is but another parametrisation.)
  Value vanilla_planes(Graph& graph) const;
  Value project(Graph& graph, const LinearLayer& layer, Value hidden, Value alpha) const;

  /// The encoded voxels of planes of this size, computed once, as a value [size, size, D] of plane `index`.
  Value plane_input(Graph& graph, std::int64_t size, int index) const;

  Device* device_;
  ParameterStore* store_;
  std::string name_;
  FieldOptions options_;
  std::vector<float> occupied_points_;
  mutable std::map<std::int64_t, std::shared_ptr<Buffer>> plane_inputs_;  // by size, [3, size, size, D]
  std::vector<UNet> unets_;
  std::vector<LinearLayer> trunk_;  // Encoding::mlp
  std::vector<LinearLayer>
      heads_;  // density, hidden, direction, colour, feature, the features' own hidden and direction
};

}  // namespace vivant
