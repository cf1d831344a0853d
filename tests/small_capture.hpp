#pragma once
#include "io_helpers.hpp"
#include "vivant/data/capture.hpp"
#include "vivant/jobs/synth.hpp"

namespace vivant {

/// A capture of a walker, 9 frames of 64 x 48; made once.
inline const Capture& small_capture() {
  static const TemporaryFolder folder;
  static const Capture capture = [] {
    synthesise({.output = folder.path(), .frames = 9, .width = 64, .height = 48, .motion = {}});
    return load_capture(folder.path());
  }();
  return capture;
}

}  // namespace vivant
