#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "vivant/jobs/config.hpp"
#include "vivant/jobs/progress.hpp"
#include "vivant/jobs/report.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

struct ReproduceOptions {
  std::vector<std::filesystem::path> captures;  ///< one or more, with different names
  Config config;                                ///< of both runs, but for the planes
  std::vector<std::filesystem::path> styles;    ///< paintings; empty: those of the program
  std::filesystem::path motion;  ///< of the novel poses; empty: dance.safetensors beside the capture, if any
  /// Folder of runs, films and report; empty: NAME-report. Of several captures: reproduction, with a folder
  /// for each.
  std::filesystem::path output;
};

/// A figure of the paper's tables, ours beside the paper's.
struct ReproductionRow {
  std::string table, capture, method, metric;
  std::optional<double> value;  ///< none: not run here, or the film is too short
  std::optional<double> paper;  ///< none: the paper gives none
};

/// The paper's tables on one capture, or on several and, as the capture "mean", the mean over them.
struct Reproduction {
  std::vector<ReproductionRow> rows;
  Report report;
  std::filesystem::path folder;

  /// {"rows": [{"table", "capture", "method", "metric", "value", "paper"}]}, null for what there is not.
  nlohmann::ordered_json json() const;
};

/// Trains each capture with geometry-guided and with vanilla planes, renders and stylises original views,
/// novel views and novel poses, paints the same frame by frame, measures all of them and the run time against
/// a perceptron field, and writes report.json, report.md and report.html. What an earlier call with the same
/// options has finished is kept, trainings go on where they stopped. Throws Interrupted after Ctrl-C,
/// UsageError for captures of one name, and Error when the folder was made with other options.
Reproduction reproduce(Device& device, const ReproduceOptions& options, Progress& progress);

}  // namespace vivant
