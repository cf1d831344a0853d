#pragma once

namespace vivant {

/// How often this program called OpenCL since its start: what a training step must not do.
struct OpenClCalls {
  int allocations = 0;   ///< buffers and views
  int compilations = 0;  ///< programs and kernel objects
  int waits = 0;         ///< for the device: finish, events, blocking reads and writes
  int launches = 0;
};
const OpenClCalls& opencl_calls();

}  // namespace vivant
