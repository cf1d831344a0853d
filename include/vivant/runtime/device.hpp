#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "vivant/runtime/arithmetic.hpp"
#include "vivant/runtime/opencl.hpp"
#include "vivant/runtime/profiler.hpp"
#include "vivant/runtime/tile_table.hpp"

namespace vivant {

/// One OpenCL device as the system lists it.
struct DeviceInfo {
  int index;  ///< what `--device` takes
  std::string platform, name, version, driver;
  bool is_gpu;
  int compute_units;
  std::uint64_t memory_bytes, largest_buffer_bytes;
  bool has_double;
};

/// Every device of every OpenCL platform; empty when there is none.
std::vector<DeviceInfo> list_devices();

struct DeviceOptions {
  std::string
      device;  ///< an index or part of a name; empty: VIVANT_DEVICE, else the first GPU, else the first CPU
  std::string device_class;  ///< "cpu", "gpu" or empty: by the device's kind
  bool profile = false;      ///< time every kernel with events
  std::string math;  ///< "fp32", "bf16x3", "bf16" or empty: VIVANT_MATH, else by the device (choose_math)
};

/// A block of device memory.
class Buffer {
 public:
  Buffer() = default;
  Buffer(Memory memory, std::size_t bytes) : memory_(std::move(memory)), bytes_(bytes) {}
  cl_mem get() const { return memory_.get(); }
  std::size_t bytes() const { return bytes_; }

 private:
  Memory memory_;
  std::size_t bytes_ = 0;
};

/// An OpenCL device with its context, one in-order queue and its compiled programs.
/// Not thread-safe: one thread uses a device at a time.
class Device {
 public:
  explicit Device(const DeviceOptions& options = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const DeviceInfo& info() const { return info_; }
  DeviceClass device_class() const { return class_; }
  /// The arithmetic of matrix products, and what computes it when it is not fp32. GPUs compute in fp32.
  Math math() const { return math_; }
  MatrixUnits matrix_units() const { return units_; }
  /// How many elements of a small product the matrix units get wrong: 0 where they work.
  int wrong_products();
  cl_context context() const { return context_.get(); }
  cl_command_queue queue() const { return queue_.get(); }
  Profiler& profiler() { return profiler_; }
  /// The register tiles that were measured on this device; executors made from now on use them.
  const TileTable& tiles() const { return tiles_; }
  void use_tiles(const TileTable& tiles) { tiles_ = tiles; }
  /// The device and its driver, as the table of tiles is stored under.
  std::string identity() const;

  /// Sub-buffers must start at a multiple of this many bytes.
  std::size_t alignment() const { return alignment_; }

  /// Allocates `bytes` of device memory (at least one byte). Throws when the device cannot.
  Buffer allocate(std::size_t bytes);
  /// A view of `bytes` bytes from `offset` on; `parent` must outlive it.
  Buffer view(const Buffer& parent, std::size_t offset, std::size_t bytes);

  void write(const Buffer& buffer, const void* data, std::size_t bytes, std::size_t offset = 0);
  void read(const Buffer& buffer, void* data, std::size_t bytes, std::size_t offset = 0);
  void fill(const Buffer& buffer, std::uint8_t byte);
  /// Copies on the device; returns at once.
  void copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset,
            std::size_t bytes);
  void finish();

  /// A fresh kernel object of `file` (a name in kernels/) compiled with `options`. Programs come from memory,
  /// the disk cache or the compiler, in this order. Throws with the build log when it does not compile.
  Kernel kernel(const std::string& file, const std::string& function, const std::string& options);
  /// Enqueues a kernel whose arguments are set, over `global` work-items in groups of `local`; returns at
  /// once. `name` is for messages and the profiler. Throws when the device refuses the launch.
  void launch(const Kernel& kernel, const std::string& name, const std::array<std::size_t, 3>& global,
              const std::array<std::size_t, 3>& local);

  /// How many buffers were allocated and kernels launched since the start.
  std::int64_t allocations() const { return allocations_; }
  std::int64_t launches() const { return launches_; }
  /// How many programs the compiler built, and how many came from the disk cache, since the start.
  int programs_built() const { return programs_built_; }
  int programs_loaded() const { return programs_loaded_; }

 private:
  void choose_arithmetic(const std::string& wanted);
  cl_program program(const std::string& file, const std::string& options);

  DeviceInfo info_;
  DeviceClass class_;
  MatrixUnits units_ = MatrixUnits::none;
  Math math_ = Math::fp32;
  cl_device_id id_ = nullptr;
  Context context_;
  Queue queue_;
  Profiler profiler_;
  TileTable tiles_;
  std::size_t alignment_ = 128;
  std::map<std::string, Program> programs_;
  int programs_built_ = 0, programs_loaded_ = 0;
  std::int64_t allocations_ = 0, launches_ = 0;
};

}  // namespace vivant
