#pragma once
#include "jobs/feature_views.hpp"
#include "vivant/graph/executor.hpp"

namespace vivant {

/// The hidden units of a patch of a view, rendered in the graph that uses them: for the stage that trains the
/// features' hidden layer. Planes, densities and weights of the samples are frozen and get no gradient.
class PatchRays {
 public:
  /// `side`: of the patch in features. The planes are those of this moment.
  PatchRays(Device& device, Graph& graph, const Config& config, const CaptureModel& model, int side);

  /// [side, side, 129 or 258], as FeatureView::hidden.
  Value hidden() const { return hidden_; }
  /// Says what the next run renders. `patch` in features.
  void write(Executor& executor, const FeatureView& view, const cv::Rect& patch) const;

 private:
  BakedPlanes scene_planes_;
  std::optional<BakedPlanes> human_planes_;
  std::optional<PersonInputs> person_;
  Value camera_, hidden_;
};

}  // namespace vivant
