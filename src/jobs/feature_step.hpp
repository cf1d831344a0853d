#pragma once
#include <memory>

#include "jobs/patch_rays.hpp"
#include "jobs/training_pictures.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/model/style_losses.hpp"
#include "vivant/nn/optimizer.hpp"

namespace vivant {

/// The side of square patches for views of this size: at most `wanted`, a multiple of 16.
int patch_side(const FeatureView& view, std::int64_t wanted);
/// A patch of a view, in pixels and on whole features; half of them around the person.
cv::Rect random_patch(KeyedRandom& random, const FeatureView& view, int side);
/// The values of a patch of a picture, and of the hidden units under it.
std::vector<float> patch_of(const cv::Mat& picture, const cv::Rect& patch);
std::vector<float> hidden_patch_of(const FeatureView& view, const cv::Rect& patch);

/// Adam on psi and the decoder, with the run's settings.
Optimizer::Options adam_on(const Config& config, const Stylizer& stylizer);

/// A step of L_v on a patch: the error of the rendered features, and of the image
/// that psi and the decoder make of them, to the true picture.
class FeatureStep {
 public:
  /// Trains the feature heads when `train_heads` is set, and with features.hidden = trained the features'
  /// hidden layers; psi and the decoder always. `weight`: of the whole loss.
  FeatureStep(Device& device, const Config& config, CaptureModel& model, const Vgg19& vgg, int side,
              bool train_heads, double weight);
  void run(const FeatureView& view, const cv::Mat& truth, const cv::Rect& patch, std::int64_t optimizer_step,
           const std::vector<double>& rates);

  struct Losses {
    double feature = 0, vgg = 0, rgb = 0, total = 0;
  };
  Losses losses();
  std::optional<TrainingFailure> failure() { return optimizer_->failure(*executor_); }
  const Optimizer& optimizer() const { return *optimizer_; }
  Executor& executor() { return *executor_; }

 private:
  Graph graph_;
  std::optional<PatchRays> rays_;  // when hidden layers are trained
  Value hidden_, rendered_, truth_;
  Values losses_;
  std::unique_ptr<Optimizer> optimizer_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace vivant
