#pragma once
#include "vivant/runtime/error.hpp"

namespace vivant {

/// A job stopped because the user asked it to, and saved its state; the message says how to go on. Exit code
/// 130.
class Interrupted : public Error {
 public:
  using Error::Error;
};

/// While one lives, the first SIGINT or SIGTERM sets a flag that jobs poll between steps; a second one ends
/// the program at once, with exit code 130. The former handlers come back at the end
/// of the outermost one.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
};

/// Whether a signal came since the outermost InterruptGuard was made.
bool interrupted();

}  // namespace vivant
