#pragma once
#include <memory>

#include "jobs/style_targets.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/jobs/pretrain_stylizer.hpp"
#include "vivant/model/style_losses.hpp"
#include "vivant/nn/optimizer.hpp"
#include "vivant/nn/vgg19.hpp"

namespace vivant {

/// What the stages of pretraining share.
struct StylizerTraining {
  StylizerTraining(Device& device, const PretrainStylizerOptions& options);

  Device& device;
  std::uint64_t seed;
  TrainingPictures photographs, paintings;
  std::vector<cv::Mat> unseen;  ///< paintings that are left out of the training
  Initializer initializer;
  ParameterStore store;
  Stylizer stylizer;
  Vgg19 vgg;
  StyleWeights weights;                  ///< of the style losses
  ChannelScales scales;                  ///< of the errors in VGG's layers
  std::vector<float> feature_deviation;  ///< [C] of relu3_1

  /// A crop of a photograph or, with probability `painted`, of a painting.
  cv::Mat crop(KeyedRandom& random, int side, double recolour, double painted = 0.5) const;
};

/// Measures VGG's layers and the least-squares read-out on random crops; writes the latter into the store
/// when `start` is set. Returns the read-out's PSNR.
double measure_pictures(StylizerTraining& training, bool start);

/// Psi and the decoder: what inversion trains.
inline Optimizer::Options decoding_parts(const Stylizer& stylizer) {
  return {.trained = {stylizer.name() + ".psi", stylizer.name() + ".decoder"}};
}
/// What the style losses train: psi and the decoder; AdaAttN's own form trains its f, g and h with them.
inline Optimizer::Options stylising_parts(const Stylizer& stylizer) {
  Optimizer::Options parts = decoding_parts(stylizer);
  if (stylizer.options().mirrored)
    for (const char* layer : {".query", ".key", ".value"}) parts.trained.push_back(stylizer.name() + layer);
  return parts;
}

/// One step of either stage; `step` counts from 0 over the whole training.
class InversionStep {
 public:
  InversionStep(StylizerTraining& training, double loss_weight);
  void run(std::int64_t step, std::int64_t optimizer_step, double rate);
  /// Waits. The mean squared error of the last step.
  double error();
  std::optional<TrainingFailure> failure() { return optimizer_->failure(*executor_); }

 private:
  StylizerTraining& training_;
  Graph graph_;
  Value sharp_, rendered_, noise_, noise_amount_, blur_amount_, detail_amount_, error_;
  std::unique_ptr<Optimizer> optimizer_;
  std::unique_ptr<Executor> executor_;
  std::vector<float> noise_values_;
};

class StyleStep {
 public:
  explicit StyleStep(StylizerTraining& training);
  void run(std::int64_t step, std::int64_t optimizer_step, double rate);
  /// Waits. Global, first layer, local, content, colours, gamut.
  std::array<double, 6> losses();
  std::optional<TrainingFailure> failure() { return optimizer_->failure(*executor_); }

 private:
  StylizerTraining& training_;
  StyleTargets targets_;
  Graph graph_;
  Value photograph_, detail_amount_;
  StyleTarget target_;
  Values losses_;
  std::unique_ptr<Optimizer> optimizer_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace vivant
