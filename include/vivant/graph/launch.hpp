#pragma once
#include <array>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "vivant/graph/types.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// A tensor as a kernel sees it. `memory` is null for an absent input.
struct Tensor {
  TensorType type;
  cl_mem memory = nullptr;

  explicit operator bool() const { return memory != nullptr; }
  const Shape& shape() const { return type.shape; }
  std::int64_t elements() const { return type.shape.elements(); }
  std::int64_t rows() const { return type.shape.rows(); }
  std::int64_t channels() const { return type.shape.channels(); }
  std::int64_t operator[](int axis) const { return type.shape[axis]; }
};

/// Macros for the build of a kernel: {{"CHANNELS", 32}, {"ACTIVATION", "relu"}}.
using Defines = std::vector<std::pair<std::string, std::variant<std::int64_t, std::string>>>;

/// A prepared command of a run: a kernel with its arguments and ranges, a copy, or (without a source) a fill
/// with zeros.
struct Command {
  std::string name;
  Kernel kernel;
  std::array<std::size_t, 3> global{1, 1, 1}, local{1, 1, 1};
  cl_mem source = nullptr, target = nullptr;
  std::size_t bytes = 0;
};

/// Collects the commands of one node while the executor plans.
class Launch {
 public:
  class Call {
   public:
    Call(Launch& launch, Kernel kernel, std::string name);
    /// Sets the arguments in order: tensors, integers, and numbers (double: passed as REAL).
    template <typename... Args>
    Call& args(const Args&... values) {
      (add(values), ...);
      return *this;
    }
    /// Enqueues over `items` work-items in groups of `local`; the range is rounded up to whole groups, so
    /// kernels check their bounds.
    void run(std::array<std::size_t, 3> items, std::array<std::size_t, 3> local);

   private:
    void add(const Tensor& tensor);
    void add(int number);
    void add(std::int64_t number);
    void add(double number);
    void set(std::size_t bytes, const void* data);

    Launch& launch_;
    Kernel kernel_;
    std::string name_;
    cl_uint next_ = 0;
  };

  Launch(Device& device, Precision precision, std::vector<Command>& commands);

  const Device& device() const { return device_; }
  bool gpu() const { return device_.device_class() == DeviceClass::gpu; }
  /// Whether matrix products run on matrix units (kernels/matrix_units.clh) rather than by fp32 kernels.
  bool bf16() const { return precision_ == Precision::single && device_.math() != Math::fp32; }
  /// Whether these units are so fast that no other algorithm for convolutions pays.
  bool matrix_tiles() const { return bf16() && device_.matrix_units() != MatrixUnits::dot; }
  /// Elements that one explicit vector of the kernels holds: 16 on CPUs, 4 on GPUs. The macro VW in kernels.
  int vector_width() const { return gpu() ? 4 : 16; }

  const Tensor& in(int i = 0) const { return inputs.at(i); }
  const Tensor& out(int i = 0) const { return outputs.at(i); }
  const Tensor& workspace(int i = 0) const { return scratch.at(i); }
  /// The i32 [1] count of live rows of a tensor; a null tensor when all are alive.
  Tensor count_of(const Tensor& tensor) const;

  /// A kernel of `file` (in kernels/) built with REAL, VW, GPU_FORM, `defines`, and when `bf16()` with
  /// MATRIX_UNITS and PRODUCTS.
  Call kernel(const std::string& file, const std::string& function, const Defines& defines = {});
  /// Copies a whole tensor, or fills it with zeros.
  void copy(const Tensor& from, const Tensor& to);
  void zero(const Tensor& tensor);

  // Filled by the executor.
  std::vector<Tensor> inputs, outputs, scratch;
  std::vector<std::pair<int, Tensor>> counts;  // by value id

 private:
  Device& device_;
  Precision precision_;
  std::vector<Command>& commands_;
};

}  // namespace vivant
