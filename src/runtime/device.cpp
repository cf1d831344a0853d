#include "vivant/runtime/device.hpp"

#include <algorithm>
#include <cstdlib>

#include "runtime/kernel_source.hpp"
#include "runtime/program_cache.hpp"

namespace vivant {
namespace {

std::string text_of(cl_device_id device, cl_device_info what) {
  std::size_t size = 0;
  check(clGetDeviceInfo(device, what, 0, nullptr, &size), "clGetDeviceInfo");
  std::string text(size, '\0');
  check(clGetDeviceInfo(device, what, size, text.data(), nullptr), "clGetDeviceInfo");
  return text.substr(0, text.find('\0'));
}

template <typename T>
T value_of(cl_device_id device, cl_device_info what) {
  T value{};
  check(clGetDeviceInfo(device, what, sizeof(value), &value, nullptr), "clGetDeviceInfo");
  return value;
}

std::vector<std::pair<cl_device_id, DeviceInfo>> all_devices() {
  std::vector<std::pair<cl_device_id, DeviceInfo>> devices;
  cl_uint count = 0;
  if (clGetPlatformIDs(0, nullptr, &count) != CL_SUCCESS) return devices;
  std::vector<cl_platform_id> platforms(count);
  check(clGetPlatformIDs(count, platforms.data(), nullptr), "clGetPlatformIDs");
  for (cl_platform_id platform : platforms) {
    cl_uint number = 0;
    if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &number) != CL_SUCCESS) continue;
    std::vector<cl_device_id> ids(number);
    check(clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, number, ids.data(), nullptr), "clGetDeviceIDs");
    char name[256] = {};
    check(clGetPlatformInfo(platform, CL_PLATFORM_NAME, sizeof(name) - 1, name, nullptr),
          "clGetPlatformInfo");
    for (cl_device_id id : ids) {
      DeviceInfo info;
      info.index = static_cast<int>(devices.size());
      info.platform = name;
      info.name = text_of(id, CL_DEVICE_NAME);
      info.version = text_of(id, CL_DEVICE_VERSION);
      info.driver = text_of(id, CL_DRIVER_VERSION);
      info.is_gpu = (value_of<cl_device_type>(id, CL_DEVICE_TYPE) & CL_DEVICE_TYPE_GPU) != 0;
      info.compute_units = static_cast<int>(value_of<cl_uint>(id, CL_DEVICE_MAX_COMPUTE_UNITS));
      info.memory_bytes = value_of<cl_ulong>(id, CL_DEVICE_GLOBAL_MEM_SIZE);
      info.largest_buffer_bytes = value_of<cl_ulong>(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE);
      info.has_double = text_of(id, CL_DEVICE_EXTENSIONS).find("cl_khr_fp64") != std::string::npos;
      devices.emplace_back(id, info);
    }
  }
  return devices;
}

std::size_t choose(const std::vector<std::pair<cl_device_id, DeviceInfo>>& devices, std::string wanted) {
  if (devices.empty())
    fail(
        "no OpenCL device was found: install an OpenCL driver, for the CPU `apt install ocl-icd-libopencl1 "
        "pocl-opencl-icd`, for a GPU the package of its vendor");
  if (wanted.empty())
    if (const char* variable = std::getenv("VIVANT_DEVICE")) wanted = variable;
  if (wanted.empty()) {
    for (std::size_t i = 0; i < devices.size(); ++i)
      if (devices[i].second.is_gpu) return i;
    return 0;
  }
  for (std::size_t i = 0; i < devices.size(); ++i)
    if (wanted == std::to_string(i)) return i;
  for (std::size_t i = 0; i < devices.size(); ++i)
    if (devices[i].second.name.find(wanted) != std::string::npos ||
        devices[i].second.platform.find(wanted) != std::string::npos)
      return i;
  throw UsageError(
      fmt::format("no OpenCL device is called '{}': `vivant devices` lists the names and numbers", wanted));
}

DeviceClass choose_class(const std::string& wanted, const DeviceInfo& info) {
  if (wanted.empty()) return info.is_gpu ? DeviceClass::gpu : DeviceClass::cpu;
  if (wanted == "cpu") return DeviceClass::cpu;
  if (wanted == "gpu") return DeviceClass::gpu;
  throw UsageError(fmt::format("unknown device class '{}': it is cpu or gpu", wanted));
}

}  // namespace

OpenClError::OpenClError(cl_int error, const char* what, std::source_location where)
    : Error(fmt::format("OpenCL: {} failed with code {} ({}:{})", what, error, where.file_name(),
                        where.line())),
      code(error) {}

void check(cl_int code, const char* what, std::source_location where) {
  if (code != CL_SUCCESS) throw OpenClError(code, what, where);
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (auto& [id, info] : all_devices()) infos.push_back(info);
  return infos;
}

Device::Device(const DeviceOptions& options) {
  const auto devices = all_devices();
  const std::size_t chosen = choose(devices, options.device);
  id_ = devices[chosen].first;
  info_ = devices[chosen].second;
  class_ = choose_class(options.device_class, info_);
  cl_int error = CL_SUCCESS;
  context_ = Context(clCreateContext(nullptr, 1, &id_, nullptr, nullptr, &error));
  check(error, "clCreateContext");
  const cl_command_queue_properties properties = options.profile ? CL_QUEUE_PROFILING_ENABLE : 0;
  queue_ = Queue(clCreateCommandQueue(context_.get(), id_, properties, &error));
  check(error, "clCreateCommandQueue");
  profiler_.enable(options.profile);
  choose_arithmetic(options.math);
  tiles_ = TileTable::load(identity(), class_);
  alignment_ = std::max<std::size_t>(128, value_of<cl_uint>(id_, CL_DEVICE_MEM_BASE_ADDR_ALIGN) / 8);
}

std::string Device::identity() const {
  return fmt::format("{}\n{}\n{}\n{}", info_.platform, info_.name, info_.version, info_.driver);
}

void Device::choose_arithmetic(const std::string& wanted) {
  // The device is this machine's processor, so what that has holds for kernels, too.
  if (class_ == DeviceClass::cpu && !info_.is_gpu) units_ = find_matrix_units();
  math_ = choose_math(wanted, units_);
  if (units_ != MatrixUnits::amx || math_ == Math::fp32) return;
  // An OpenCL compiler may refuse the instructions, or get them wrong.
  try {
    if (wrong_products() == 0) return;
  } catch (const Error&) {
  }
  if (std::getenv("VIVANT_VERBOSE")) fmt::print(stderr, "AMX does not work on {}: fp32\n", info_.name);
  units_ = MatrixUnits::none;
  math_ = Math::fp32;
}

int Device::wrong_products() {
  const Kernel kernel = this->kernel(
      "check_units.cl", "check_units",
      fmt::format("-cl-std=CL1.2 -cl-denorms-are-zero -DMATRIX_UNITS={}", static_cast<int>(units_)));
  const Buffer count = allocate(sizeof(cl_int));
  cl_mem memory = count.get();
  check(clSetKernelArg(kernel.get(), 0, sizeof(cl_mem), &memory), "clSetKernelArg");
  launch(kernel, "check_units", {1, 1, 1}, {1, 1, 1});
  cl_int wrong = 0;
  read(count, &wrong, sizeof(wrong));
  return wrong;
}

Device::~Device() {
  if (queue_) clFinish(queue_.get());
}

Buffer Device::allocate(std::size_t bytes) {
  bytes = std::max<std::size_t>(bytes, 1);
  if (bytes > info_.largest_buffer_bytes)
    fail("a buffer of {} MiB was asked for, the device allows {} MiB: use fewer rays or smaller images",
         bytes >> 20, info_.largest_buffer_bytes >> 20);
  cl_int error = CL_SUCCESS;
  Memory memory(clCreateBuffer(context_.get(), CL_MEM_READ_WRITE, bytes, nullptr, &error));
  check(error, "clCreateBuffer");
  ++allocations_;
  return Buffer(std::move(memory), bytes);
}

Buffer Device::view(const Buffer& parent, std::size_t offset, std::size_t bytes) {
  const cl_buffer_region region{offset, std::max<std::size_t>(bytes, 1)};
  cl_int error = CL_SUCCESS;
  Memory memory(
      clCreateSubBuffer(parent.get(), CL_MEM_READ_WRITE, CL_BUFFER_CREATE_TYPE_REGION, &region, &error));
  check(error, "clCreateSubBuffer");
  return Buffer(std::move(memory), region.size);
}

void Device::write(const Buffer& buffer, const void* data, std::size_t bytes, std::size_t offset) {
  if (bytes == 0) return;
  check(clEnqueueWriteBuffer(queue(), buffer.get(), CL_TRUE, offset, bytes, data, 0, nullptr, nullptr),
        "clEnqueueWriteBuffer");
}

void Device::read(const Buffer& buffer, void* data, std::size_t bytes, std::size_t offset) {
  if (bytes == 0) return;
  check(clEnqueueReadBuffer(queue(), buffer.get(), CL_TRUE, offset, bytes, data, 0, nullptr, nullptr),
        "clEnqueueReadBuffer");
}

void Device::fill(const Buffer& buffer, std::uint8_t byte) {
  check(clEnqueueFillBuffer(queue(), buffer.get(), &byte, 1, 0, buffer.bytes(), 0, nullptr, nullptr),
        "clEnqueueFillBuffer");
}

void Device::copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset,
                  std::size_t bytes) {
  check(
      clEnqueueCopyBuffer(queue(), from.get(), to.get(), from_offset, to_offset, bytes, 0, nullptr, nullptr),
      "clEnqueueCopyBuffer");
}

void Device::finish() { check(clFinish(queue()), "clFinish"); }

cl_program Device::program(const std::string& file, const std::string& options) {
  const std::string source = kernel_source(file);
  const std::string key = fmt::format("{}\n{}\n{}", identity(), options, source);
  if (const auto found = programs_.find(key); found != programs_.end()) return found->second.get();
  cl_int error = CL_SUCCESS;
  if (const auto binary = ProgramCache::load(key)) {
    const unsigned char* data = binary->data();
    const std::size_t size = binary->size();
    cl_int status = CL_SUCCESS;
    Program loaded(clCreateProgramWithBinary(context(), 1, &id_, &size, &data, &status, &error));
    if (error == CL_SUCCESS && status == CL_SUCCESS &&
        clBuildProgram(loaded.get(), 1, &id_, options.c_str(), nullptr, nullptr) == CL_SUCCESS) {
      ++programs_loaded_;
      return programs_.emplace(key, std::move(loaded)).first->second.get();
    }
    ProgramCache::remove(key);
  }
  const char* text = source.c_str();
  Program built(clCreateProgramWithSource(context(), 1, &text, nullptr, &error));
  check(error, "clCreateProgramWithSource");
  if (clBuildProgram(built.get(), 1, &id_, options.c_str(), nullptr, nullptr) != CL_SUCCESS) {
    std::size_t size = 0;
    clGetProgramBuildInfo(built.get(), id_, CL_PROGRAM_BUILD_LOG, 0, nullptr, &size);
    std::string log(size, '\0');
    clGetProgramBuildInfo(built.get(), id_, CL_PROGRAM_BUILD_LOG, size, log.data(), nullptr);
    fail("kernels/{} does not compile on {} with options '{}':\n{}", file, info_.name, options, log);
  }
  if (std::getenv("VIVANT_VERBOSE")) fmt::print(stderr, "built {} {}\n", file, options);
  ++programs_built_;
  std::size_t size = 0;
  check(clGetProgramInfo(built.get(), CL_PROGRAM_BINARY_SIZES, sizeof(size), &size, nullptr),
        "clGetProgramInfo");
  std::vector<unsigned char> binary(size);
  unsigned char* data = binary.data();
  if (size > 0 &&
      clGetProgramInfo(built.get(), CL_PROGRAM_BINARIES, sizeof(data), &data, nullptr) == CL_SUCCESS)
    ProgramCache::store(key, binary);
  return programs_.emplace(key, std::move(built)).first->second.get();
}

Kernel Device::kernel(const std::string& file, const std::string& function, const std::string& options) {
  cl_int error = CL_SUCCESS;
  Kernel kernel(clCreateKernel(program(file, options), function.c_str(), &error));
  check(error, fmt::format("clCreateKernel {} in {}", function, file).c_str());
  return kernel;
}

void Device::launch(const Kernel& kernel, const std::string& name, const std::array<std::size_t, 3>& global,
                    const std::array<std::size_t, 3>& local) {
  cl_event event = nullptr;
  const cl_int code = clEnqueueNDRangeKernel(queue(), kernel.get(), 3, nullptr, global.data(), local.data(),
                                             0, nullptr, profiler_.enabled() ? &event : nullptr);
  if (code != CL_SUCCESS) fail("OpenCL: the launch of kernel {} is refused with code {}", name, code);
  ++launches_;
  if (event) profiler_.record(name, event);
}

}  // namespace vivant
