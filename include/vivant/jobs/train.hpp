#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "vivant/jobs/config.hpp"
#include "vivant/jobs/progress.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

struct TrainOptions {
  std::filesystem::path capture;  ///< empty when a run is resumed
  std::filesystem::path run;
  std::string stage = "all";     ///< reconstruct, features, style or all
  std::filesystem::path styles;  ///< folder of paintings for stage style; empty: those of the program
  bool resume = false;
  Config config;              ///< of a new run; a resumed run has its own
  bool print_plan = false;    ///< prints the first training graph and stops
  std::filesystem::path dot;  ///< writes its drawing and stops
};

/// Trains a capture's model in a run folder, stage after stage: new, or from the newest checkpoint. Throws
/// Interrupted after Ctrl-C, when all is saved.
void train(Device& device, const TrainOptions& options, Progress& progress);

}  // namespace vivant
