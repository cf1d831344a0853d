#pragma once
#include <memory>

#include "vivant/data/capture.hpp"
#include "vivant/io/checkpoint.hpp"
#include "vivant/jobs/config.hpp"
#include "vivant/model/camera_refinement.hpp"
#include "vivant/model/content_norm.hpp"
#include "vivant/model/exposure_correction.hpp"
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
  /// The corrections of the cameras; null when they stay as they are.
  const CameraRefinement* camera_refinement() const { return cameras_.get(); }
  /// The exposures of the frames; null when all are alike.
  const ExposureCorrection* exposure_correction() const { return exposures_.get(); }
  /// The capture with its cameras corrected, the person moved with them, and its exposures known: what the
  /// stages after the scene's train on, and what is rendered.
  Capture corrected(const Capture& capture) const;
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
  std::unique_ptr<CameraRefinement> cameras_;
  std::unique_ptr<ExposureCorrection> exposures_;
  std::unique_ptr<HumanModel> human_;
  std::unique_ptr<Stylizer> stylizer_;
  std::unique_ptr<RunningContentNorm> content_norm_;
};

/// The codes of poses that were not trained on.
HumanModel::CodeRow novel_codes(const Config& config, const HumanModel& model);

/// How the person of a run is rendered. `view_direction`: for poses that were trained on, or near to them.
HumanRenderer::Options human_renderer_options(const Config& config, bool view_direction);

}  // namespace vivant
