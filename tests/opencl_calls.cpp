// Stands before the OpenCL library: counts the calls of interest and passes them on.
#include "opencl_calls.hpp"

#include <CL/cl.h>
#include <dlfcn.h>

namespace {

vivant::OpenClCalls calls;

template <typename Function>
Function next(Function, const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

const vivant::OpenClCalls& vivant::opencl_calls() { return calls; }

#define PASS_ON(function, ...)                            \
  static const auto original = next(function, #function); \
  return original(__VA_ARGS__)

extern "C" {

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error) {
  ++calls.allocations;
  PASS_ON(clCreateBuffer, context, flags, size, host, error);
}
cl_mem clCreateSubBuffer(cl_mem buffer, cl_mem_flags flags, cl_buffer_create_type type, const void* info,
                         cl_int* error) {
  ++calls.allocations;
  PASS_ON(clCreateSubBuffer, buffer, flags, type, info, error);
}
cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                      void(CL_CALLBACK* notify)(cl_program, void*), void* data) {
  ++calls.compilations;
  PASS_ON(clBuildProgram, program, count, devices, options, notify, data);
}
cl_kernel clCreateKernel(cl_program program, const char* name, cl_int* error) {
  ++calls.compilations;
  PASS_ON(clCreateKernel, program, name, error);
}
cl_int clFinish(cl_command_queue queue) {
  ++calls.waits;
  PASS_ON(clFinish, queue);
}
cl_int clWaitForEvents(cl_uint count, const cl_event* events) {
  ++calls.waits;
  PASS_ON(clWaitForEvents, count, events);
}
cl_int clEnqueueReadBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset,
                           size_t size, void* data, cl_uint count, const cl_event* events, cl_event* event) {
  calls.waits += blocking ? 1 : 0;
  PASS_ON(clEnqueueReadBuffer, queue, buffer, blocking, offset, size, data, count, events, event);
}
cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset,
                            size_t size, const void* data, cl_uint count, const cl_event* events,
                            cl_event* event) {
  calls.waits += blocking ? 1 : 0;
  PASS_ON(clEnqueueWriteBuffer, queue, buffer, blocking, offset, size, data, count, events, event);
}
cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                              const size_t* offset, const size_t* global, const size_t* local, cl_uint count,
                              const cl_event* events, cl_event* event) {
  ++calls.launches;
  PASS_ON(clEnqueueNDRangeKernel, queue, kernel, dimensions, offset, global, local, count, events, event);
}

}  // extern "C"
