#pragma once
#include <memory>

#include "vivant/data/capture.hpp"
#include "vivant/io/checkpoint.hpp"
#include "vivant/jobs/config.hpp"
#include "vivant/model/content_norm.hpp"
#include "vivant/model/human_renderer.hpp"
#include "vivant/model/scene_model.hpp"

namespace vivant {

/// All that is trained for a capture: the fields of scene and person and the stylizer, with their parameters
/// in one store. Made from configuration and capture alone, so that a run's folder is enough to make it
/// again.
class CaptureModel {
 public:
  CaptureModel(Device& device, const Config& config, const Capture& capture);

  Device& device() { return device_; }
  ParameterStore& store() { return store_; }
  const SceneModel& scene() const { return *scene_; }
  /// The person; null for a capture without one.
  const HumanModel* human() const { return human_.get(); }
  /// Starts as the one that comes with the program.
  const Stylizer& stylizer() const { return *stylizer_; }
  /// The statistics of norm(c) of this capture.
  const RunningContentNorm& content_norm() const { return *content_norm_; }

 private:
  Device& device_;
  ParameterStore store_;
  std::unique_ptr<SceneModel> scene_;
  std::unique_ptr<HumanModel> human_;
  std::unique_ptr<Stylizer> stylizer_;
  std::unique_ptr<RunningContentNorm> content_norm_;
};

/// The codes of poses that were not trained on.
HumanModel::CodeRow novel_codes(const Config& config, const HumanModel& model);

/// How the person of a run is rendered. `view_direction`: for poses that were trained on, or near to them.
HumanRenderer::Options human_renderer_options(const Config& config, bool view_direction);

}  // namespace vivant
