#pragma once
#include <CL/cl.h>

#include <source_location>
#include <string>
#include <utility>

#include "vivant/runtime/error.hpp"

namespace vivant {

/// An OpenCL call failed. The message names the call, the error code and the place in our sources.
class OpenClError : public Error {
 public:
  OpenClError(cl_int code, const char* what, std::source_location where);
  cl_int code;
};

/// Throws OpenClError unless `code` is CL_SUCCESS.
void check(cl_int code, const char* what, std::source_location where = std::source_location::current());

/// Owns one OpenCL object and releases it with `Release`.
template <typename Handle, cl_int (*Release)(Handle)>
class Owned {
 public:
  Owned() = default;
  explicit Owned(Handle handle) : handle_(handle) {}
  Owned(Owned&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Owned& operator=(Owned&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Owned() {
    if (handle_) Release(handle_);
  }
  Handle get() const { return handle_; }
  explicit operator bool() const { return handle_ != nullptr; }

 private:
  Handle handle_ = nullptr;
};

using Context = Owned<cl_context, clReleaseContext>;
using Queue = Owned<cl_command_queue, clReleaseCommandQueue>;
using Memory = Owned<cl_mem, clReleaseMemObject>;
using Program = Owned<cl_program, clReleaseProgram>;
using Kernel = Owned<cl_kernel, clReleaseKernel>;
using Event = Owned<cl_event, clReleaseEvent>;

}  // namespace vivant
