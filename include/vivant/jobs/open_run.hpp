#pragma once
#include <filesystem>
#include <memory>

#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/progress.hpp"
#include "vivant/jobs/run_folder.hpp"

namespace vivant {

/// A trained run, ready to be looked at: its configuration, its capture and the model of its newest
/// checkpoint.
struct OpenRun {
  RunFolder folder;
  Config config;
  Capture given;    ///< the capture as it was given
  Capture capture;  ///< with corrected cameras, poses and exposures, as the model sees it
  std::unique_ptr<CaptureModel> model;
  std::filesystem::path checkpoint;  ///< the file that the model comes from
  bool has_features = false;         ///< the fields have learned to render features, which styles need
};

/// Opens a run for reading. Throws Error when it has no checkpoint yet; tells `progress` of damaged ones
/// passed over.
OpenRun open_run(Device& device, const std::filesystem::path& path, Progress& progress);

}  // namespace vivant
