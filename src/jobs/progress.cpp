#include "vivant/jobs/progress.hpp"

#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "jobs/progress_bar.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

constexpr double seconds_between_drawings = 0.1;

int terminal_width() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col - 1 : 99;
}

double seconds_between(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

ProgressMode progress_mode_from(const std::string& name) {
  if (name == "auto") return ProgressMode::automatic;
  if (name == "bar") return ProgressMode::bar;
  if (name == "json") return ProgressMode::json;
  if (name == "none") return ProgressMode::none;
  throw UsageError(fmt::format("unknown progress mode '{}': use auto, bar, json or none", name));
}

Progress::Progress(ProgressMode mode, bool verbose) : mode_(mode), verbose_(verbose) {
  if (mode_ == ProgressMode::automatic)
    mode_ = isatty(STDERR_FILENO) ? ProgressMode::bar : ProgressMode::none;
}

Progress::~Progress() { end(); }

void Progress::record_in(const RunFolder& run) {
  metrics_path_ = run.metrics().string();
  metrics_.open(run.metrics(), std::ios::app);
  if (!metrics_) fail("cannot write '{}'", metrics_path_);
  try {
    log_ = std::make_shared<spdlog::logger>(
        "run", std::make_shared<spdlog::sinks::basic_file_sink_st>(run.log().string()));
  } catch (const spdlog::spdlog_ex&) {
    fail("cannot write '{}'", run.log().string());
  }
  log_->set_pattern("%Y-%m-%d %H:%M:%S %-7l %v");
  log_->set_level(spdlog::level::debug);
  log_->flush_on(spdlog::level::debug);
}

void Progress::record_nowhere() {
  metrics_.close();
  log_.reset();
}

void Progress::begin(const std::string& stage, std::int64_t done, std::int64_t steps) {
  end();
  stage_ = stage;
  first_ = done;
  steps_ = steps;
  begun_ = reported_ = Clock::now();
  drawn_ = {};
}

void Progress::report(const StepReport& report) {
  const Clock::time_point now = Clock::now();
  const double seconds = seconds_between(begun_, now), since = seconds_between(reported_, now);
  const double rays_per_second = since > 0 ? report.rays / since : 0;
  reported_ = now;
  nlohmann::json row = {{"stage", stage_}, {"step", report.step}, {"seconds", seconds}};
  if (report.loss) row["loss"] = *report.loss;
  if (report.psnr) row["psnr"] = *report.psnr;
  if (report.rays > 0) row["rays_per_second"] = rays_per_second;
  for (const auto& [name, number] : report.more) row[name] = number;
  if (metrics_.is_open()) {
    metrics_ << row.dump() << '\n' << std::flush;
    if (!metrics_) fail("cannot write '{}': is the disk full?", metrics_path_);
  }
  if (mode_ == ProgressMode::json) {
    row["steps"] = steps_;
    row["memory_bytes"] = resident_memory_bytes();
    fmt::print(stderr, "{}\n", row.dump());
  }
  const bool due = report.step >= steps_ || seconds_between(drawn_, now) > seconds_between_drawings;
  if (mode_ == ProgressMode::bar && due) {
    drawn_ = now;
    draw(report, seconds, rays_per_second);
  }
}

void Progress::draw(const StepReport& report, double seconds, double rays_per_second) {
  BarContent content;
  content.stage = stage_;
  content.step = report.step;
  content.steps = steps_;
  content.loss = report.loss;
  content.psnr = report.psnr;
  content.rays_per_second = rays_per_second;
  if (report.step > first_)
    content.seconds_left =
        seconds * static_cast<double>(steps_ - report.step) / static_cast<double>(report.step - first_);
  content.memory_bytes = resident_memory_bytes();
  fmt::print(stderr, "\r{}\x1b[K", bar_text(content, terminal_width()));
  bar_visible_ = true;
}

void Progress::end() {
  if (bar_visible_) fmt::print(stderr, "\n");  // the last state stays
  bar_visible_ = false;
}

void Progress::show(const char* level, const std::string& message) {
  if (mode_ == ProgressMode::json) {
    const nlohmann::json row = {{"level", level}, {"message", message}};
    fmt::print(stderr, "{}\n", row.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    return;
  }
  if (bar_visible_) fmt::print(stderr, "\r\x1b[K");
  bar_visible_ = false;
  fmt::print(stderr, "{}{}\n", level == std::string_view("warning") ? "warning: " : "", message);
}

void Progress::info(const std::string& message) {
  show("info", message);
  if (log_) log_->info(message);
}

void Progress::warn(const std::string& message) {
  show("warning", message);
  if (log_) log_->warn(message);
}

void Progress::detail(const std::string& message) {
  if (verbose_) show("detail", message);
  if (log_) log_->debug(message);
}

}  // namespace vivant
