#include "vivant/runtime/profiler.hpp"

#include <algorithm>

namespace vivant {

void Profiler::record(const std::string& kernel, cl_event event) {
  pending_.emplace_back(kernel, Event(event));
  if (pending_.size() > 4096) totals();  // bounds the memory of a long run
}

const std::map<std::string, Profiler::Entry>& Profiler::totals() {
  for (auto& [name, event] : pending_) {
    const cl_event handle = event.get();
    check(clWaitForEvents(1, &handle), "clWaitForEvents");
    cl_ulong start = 0, end = 0;
    check(clGetEventProfilingInfo(handle, CL_PROFILING_COMMAND_START, sizeof(start), &start, nullptr),
          "clGetEventProfilingInfo");
    check(clGetEventProfilingInfo(handle, CL_PROFILING_COMMAND_END, sizeof(end), &end, nullptr),
          "clGetEventProfilingInfo");
    Entry& entry = totals_[name];
    ++entry.launches;
    entry.seconds += static_cast<double>(end - start) * 1e-9;
  }
  pending_.clear();
  return totals_;
}

void Profiler::reset() {
  pending_.clear();
  totals_.clear();
}

std::string Profiler::table() {
  totals();
  std::vector<std::pair<std::string, Entry>> rows(totals_.begin(), totals_.end());
  std::sort(rows.begin(), rows.end(), [](auto& a, auto& b) { return a.second.seconds > b.second.seconds; });
  double all = 0;
  for (auto& row : rows) all += row.second.seconds;
  std::string text = fmt::format("{:<44} {:>9} {:>11} {:>6}\n", "kernel", "launches", "ms", "%");
  for (auto& [name, entry] : rows)
    text += fmt::format("{:<44} {:>9} {:>11.3f} {:>6.1f}\n", name, entry.launches, entry.seconds * 1e3,
                        all > 0 ? 100 * entry.seconds / all : 0.0);
  return text;
}

}  // namespace vivant
