#pragma once
#include <utility>
#include <vector>

#include "vivant/model/body_model.hpp"
#include "vivant/model/field.hpp"
#include "vivant/ops/bone_correction.hpp"
#include "vivant/ops/human_samples.hpp"

namespace vivant {

/// The point that the error correction reads: in the canonical pose, which all poses share, or as it is
/// observed, relative to the root (the paper's).
enum class ErrorInput { canonical, observed };

struct HumanOptions {
  FieldOptions field;
  double box_margin = 0.1;              ///< metres between the canonical body and the field's box
  CanonicalPoseOptions canonical = {};  ///< the X-pose
  bool distance_prior = true;           ///< the signed distance to the body shifts the density
  bool bone_corrections = true;         ///< small corrections of every frame's bones
  bool error_correction = true;         ///< the paper's E
  ErrorInput error_input = ErrorInput::canonical;
  int error_layers = 4, error_width = 128;     ///< of E
  int error_frequencies = 6, error_codes = 8;  ///< octaves of E's input, numbers of a frame code
};

/// What is learned of single frames, G rows: parameters while training, one row while rendering.
struct FrameCodes {
  Value error;  ///< [G, error_codes]
  Value bones;  ///< [G, J, 6]
};

/// The codes, and in rows G .. 2 G - 1 the same as constants, which no gradient reaches.
FrameCodes with_constant_copies(Graph& graph, const FrameCodes& codes);

/// What the field says of samples on R rays with at most S samples each; N rows hold the samples that exist.
struct HumanFieldSamples {
  Value depths, deltas;    ///< [R, S]
  Value density = {};      ///< [R, S], 0 where there is no sample
  Value row_density = {};  ///< [N, 1]
  UnitInputs units = {};   ///< of the output that was asked for
  Value ids = {};          ///< i32 [N] place of a row among the R S samples; absent: as they lie
  Value correction = {};   ///< [N, 3] what was added to the canonical points, metres; absent when nothing is
};

/// The person: a radiance field in the canonical pose, corrected there by E and by bone corrections.
///
/// Parameters: those of the field, `human.error...`, `human.error_codes`, `human.bone_codes`.
class HumanModel {
 public:
  /// `body`: the person's own shape. `frames`: the number of training frames, each of which has a row of
  /// codes.
  HumanModel(Device& device, ParameterStore& store, const Initializer& initializer,
             const HumanOptions& options, Body body, int frames);

  const Field& field() const { return field_; }
  const HumanOptions& options() const { return options_; }
  const BodyModel& body() const { return body_; }

  /// The codes of all training frames.
  FrameCodes codes(Graph& graph) const;
  /// What E and the bones add to canonical points, [N, 3] metres, times `fade` [1]; absent when both are off.
  Value correction(Graph& graph, const HumanSamples& samples, const FrameCodes& codes, Value fade) const;
  /// Features of canonical points [N, 3] in metres: [N, C].
  Value features(Graph& graph, Value planes, Value canonical) const;
  /// Density per metre [N, 1]. The prior adds 2 clamp(-signed_distance / 3 cm, -3, 1) before the activation.
  Value density(Graph& graph, Value features, Value signed_distance) const;
  /// Hidden units [N, 128] for `output`.
  Value hidden(Graph& graph, Value features, const Facing& facing, Output output = Output::colour) const;

  /// All of these for samples on rays. `keep` [N, 1]: see Facing.
  HumanFieldSamples query(Graph& graph, Value planes, const HumanSamples& samples, const FrameCodes& codes,
                          Value fade, Value keep = {}, Output output = Output::colour) const;

  /// One row of codes, for rendering.
  struct CodeRow {
    std::vector<float> error, bones;
  };
  /// sum of weight * row over (row, weight); an empty list gives zeros.
  CodeRow mixed_codes(const std::vector<std::pair<int, double>>& rows) const;
  /// Exactly one row for each training frame.
  void write_codes(const std::vector<CodeRow>& rows);
  /// The mean over all training frames: for novel poses.
  CodeRow mean_codes() const;

 private:
  /// Canonical points [N, 3] in metres -> [-1, 1]^3 in the field's box.
  Value in_canonical_box(Value points) const;
  Value error_correction(Graph& graph, const HumanSamples& samples, Value codes) const;
  SkinTables skin_tables(Graph& graph) const;

  ParameterStore* store_;
  HumanOptions options_;
  BodyModel body_;
  std::vector<Eigen::Vector3d> canonical_joints_;
  int frames_;
  Field field_;
  std::vector<LinearLayer> error_layers_;
};

}  // namespace vivant
