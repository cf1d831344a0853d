#pragma once
#include "vivant/model/human_model.hpp"
#include "vivant/model/scene_model.hpp"

namespace vivant {

/// The length that a sample stands for once two fields' samples are merged.
enum class Intervals {
  own,    ///< of its own ray: a field without density changes nothing
  merged  ///< to the next sample of either field, the paper's letter: empty samples of the person thin the
          ///< wall behind
};
/// "own" or "merged"; throws UsageError for another name.
Intervals intervals_from(const std::string& name);

/// What rays see of both fields. W_s, b_s and W_h, b_h being the last layers, a pixel is W_s H_s + b_s a_s +
/// W_h H_h + b_h a_h.
struct CompositeRays {
  Value scene_hidden, human_hidden;  ///< [R, 128]
  Value scene_alpha, human_alpha;    ///< [R, 1]
  Value scene_depth, human_depth;    ///< [R, 1], of what each shows, see peak_depth
};

/// Merges the samples of both fields by depth (at equal depths the scene comes first) and renders them with
/// one equation. Samples that weigh less than `threshold` have no hidden units.
CompositeRays composite(Graph& graph, const FieldSamples& scene_samples,
                        const HumanFieldSamples& human_samples, Intervals intervals, double threshold = 0);

/// The rays' colours [R, 3], features [R, 256] or hidden units [R, 258], those of the scene first.
Value composite_output(Graph& graph, const SceneModel& scene, const HumanModel& human,
                       const CompositeRays& rays, Output output = Output::colour);

}  // namespace vivant
