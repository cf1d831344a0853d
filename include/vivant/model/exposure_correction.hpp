#pragma once
#include "vivant/data/capture.hpp"
#include "vivant/nn/parameters.hpp"

namespace vivant {

/// What each training frame's exposure does to the colours of the scene, learned with it: a gain and an
/// offset for each channel, which start at 1 and 0. Films are rendered without them.
class ExposureCorrection {
 public:
  ExposureCorrection(ParameterStore& store, int training_frames);

  /// Colours [R, 3] as their frames i32 [R] (rows of the training frames) show them.
  Value exposed(Graph& graph, Value colours, Value frames) const;
  /// The mean square of what is learned: gains less 1, and offsets.
  Value mean_square(Graph& graph) const;

  /// The capture with the exposures of its frames; held-out frames stand between their neighbours in time.
  Capture corrected(const Capture& capture) const;

 private:
  ParameterStore& store_;
  int frames_;
};

}  // namespace vivant
