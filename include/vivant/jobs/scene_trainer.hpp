#pragma once
#include <memory>

#include "vivant/graph/executor.hpp"
#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/stage.hpp"
#include "vivant/model/device_capture.hpp"
#include "vivant/nn/optimizer.hpp"

namespace vivant {

/// Trains the scene field on the pixels outside of the person: mean squared error
/// of random pixels, several ray batches per pass of the U-Nets.
class SceneTrainer final : public StageTrainer {
 public:
  SceneTrainer(Device& device, const Config& config, const Capture& capture, const DeviceCapture& data,
               CaptureModel& model);

  std::int64_t steps() const override { return config_.scene.steps; }
  void run(std::int64_t step) override;
  StepReport report(std::int64_t step) override;
  std::optional<TrainingFailure> failure() override;
  void diagnose(std::int64_t step) override;
  void preview(const std::filesystem::path& folder, const std::string& stem) override;
  const Executor& executor() const override { return *phase_->executor; }

 private:
  /// Steps with one size of the planes: small planes learn fastest at first.
  struct Phase {
    std::int64_t first_step = 0, plane_size = 0;
    Graph graph;
    Value seed, step, loss, squared_error;
    std::map<std::string, Value> corrections;  ///< mean squares by name
    std::unique_ptr<Optimizer> optimizer;
    std::unique_ptr<Executor> executor;
  };
  void begin_phase(std::int64_t step);
  Phase& phase() { return *phase_; }
  /// A step's random entries of a list as long as the background's pixels.
  Value drawn(Graph& graph, const std::string& name, const std::shared_ptr<Buffer>& list,
              const RandomKey& key);
  Value batch_loss(Graph& graph, Value planes, int batch);

  Device& device_;
  const Config& config_;
  const Capture& capture_;
  const DeviceCapture& data_;
  const CaptureModel& trained_;
  ParameterStore& store_;
  const SceneModel& model_;
  const CameraRefinement* cameras_;      ///< null: the capture's are right
  const ExposureCorrection* exposures_;  ///< null: all frames are exposed alike
  std::shared_ptr<Buffer> pixels_, pixel_frames_;
  std::int64_t pixel_count_ = 0, reported_step_ = -1;
  std::unique_ptr<Phase> phase_;
};

}  // namespace vivant
