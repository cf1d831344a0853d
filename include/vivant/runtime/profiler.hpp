#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "vivant/runtime/opencl.hpp"

namespace vivant {

/// Adds up the device time of kernels by name. Off by default: events cost time on small kernels.
class Profiler {
 public:
  struct Entry {
    std::int64_t launches = 0;
    double seconds = 0;
  };

  void enable(bool on) { enabled_ = on; }
  bool enabled() const { return enabled_; }
  /// Takes ownership of an event of a launch of `kernel`.
  void record(const std::string& kernel, cl_event event);
  /// Waits for the recorded events and returns the totals by kernel name since the last `reset`.
  const std::map<std::string, Entry>& totals();
  void reset();
  /// The totals as a table, slowest first.
  std::string table();

 private:
  bool enabled_ = false;
  std::vector<std::pair<std::string, Event>> pending_;
  std::map<std::string, Entry> totals_;
};

}  // namespace vivant
