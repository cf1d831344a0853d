#pragma once
#include "vivant/data/capture.hpp"
#include "vivant/nn/parameters.hpp"
#include "vivant/ops/rays.hpp"

namespace vivant {

/// Small corrections of the cameras of a capture's training frames, learned with the scene: fitted cameras
/// are off by a few pixels, which blurs what they see together. A parameter of six numbers a frame, which
/// start at zero (rotation and translation of ray_correction).
class CameraRefinement {
 public:
  /// `unit`: the length of a translation of 1, about the scene's size, so that all six numbers move the
  /// picture alike; 0 for cameras that only turn.
  CameraRefinement(ParameterStore& store, int training_frames, double unit);

  /// Rays of the training frames as their corrected cameras have them; pixels as ray_generation takes them.
  Rays corrected(Graph& graph, const Rays& rays, Value pixels, std::int64_t frame_pixels) const;
  /// The mean square of the corrections.
  Value mean_square(Graph& graph) const;

  /// The capture with its corrected cameras; held-out frames move as their neighbours in time. The person
  /// keeps their place before the camera, as poses are fitted to pictures; but a pose that several frames
  /// show stays, as nothing tells which of the cameras it was fitted to.
  Capture corrected(const Capture& capture) const;

 private:
  ParameterStore& store_;
  int frames_;
  double unit_;
};

}  // namespace vivant
