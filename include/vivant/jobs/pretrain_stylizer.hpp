#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "vivant/jobs/progress.hpp"
#include "vivant/model/style_losses.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

struct PretrainStylizerOptions {
  std::vector<std::filesystem::path> photographs, paintings;  ///< folders of pictures
  /// Pictures whose file name starts so are not trained on; those among the paintings are tried in the
  /// previews.
  std::vector<std::string> unseen = {"starry_night", "great_wave"};
  std::filesystem::path run;     ///< folder for checkpoints, previews and metrics
  std::filesystem::path output;  ///< stylizer.safetensors
  std::string form = "guided";   ///< see StylizerOptions::of_form
  std::uint64_t seed = 1;
  std::int64_t inversion_steps = 1000;           ///< psi and the decoder learn to turn features into colours
  std::int64_t style_steps = 2600;               ///< then the losses of stage 3
  double global_weight = StyleWeights{}.global;  ///< of AdaAttN's global style loss in stage 3
  bool resume = false;
};

/// Trains psi and the decoder of a stylizer (of AdaAttN's own forms f, g, h and the decoder) once, on VGG-19
/// features of photographs and paintings: from then on it works on any capture and painting without training.
/// Deterministic by seed. Throws Interrupted after Ctrl-C with the state saved, so that `resume` goes on with
/// the same bits.
void pretrain_stylizer(Device& device, const PretrainStylizerOptions& options, Progress& progress);

}  // namespace vivant
