#pragma once
#include <chrono>
#include <cstdint>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "vivant/jobs/run_folder.hpp"

namespace spdlog {
class logger;
}

namespace vivant {

/// How a job shows its progress on stderr: a bar that is redrawn, a JSON object per line, or messages alone.
/// `automatic` is a bar on a terminal, else messages alone.
enum class ProgressMode { automatic, bar, json, none };

/// Throws UsageError for other names than auto, bar, json and none.
ProgressMode progress_mode_from(const std::string& name);

/// What a job says every few steps.
struct StepReport {
  std::int64_t step = 0;  ///< done in this stage
  std::optional<double> loss = {}, psnr = {};
  double rays = 0;  ///< worked on since the last report; 0 where rays are not what counts
  std::map<std::string, double> more = {};  ///< for metrics.jsonl alone: single losses, rates
};

/// Shows and records the progress of long work.
class Progress {
 public:
  Progress(ProgressMode mode, bool verbose);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// From now on reports are added to the run's metrics.jsonl and messages to its log.txt.
  void record_in(const RunFolder& run);
  /// Ends that.
  void record_nowhere();

  /// A stage of `steps` steps begins, of which `done` were done before, in an interrupted run.
  void begin(const std::string& stage, std::int64_t done, std::int64_t steps);
  void report(const StepReport& report);
  void end();

  void info(const std::string& message);
  void warn(const std::string& message);
  /// Shown with --verbose, always in log.txt.
  void detail(const std::string& message);

 private:
  using Clock = std::chrono::steady_clock;
  void draw(const StepReport& report, double seconds, double rays_per_second);
  void show(const char* level, const std::string& message);

  ProgressMode mode_;
  bool verbose_;
  std::string stage_;
  std::int64_t first_ = 0, steps_ = 0;
  Clock::time_point begun_, reported_, drawn_;
  bool bar_visible_ = false;
  std::ofstream metrics_;
  std::string metrics_path_;
  std::shared_ptr<spdlog::logger> log_;
};

}  // namespace vivant
