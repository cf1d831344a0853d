#include "vivant/graph/launch.hpp"

namespace vivant {

Launch::Launch(Device& device, Precision precision, std::vector<Command>& commands)
    : device_(device), precision_(precision), commands_(commands) {}

Tensor Launch::count_of(const Tensor& tensor) const {
  if (tensor.type.count >= 0)
    for (const auto& [id, count] : counts)
      if (id == tensor.type.count) return count;
  return {};
}

Launch::Call Launch::kernel(const std::string& file, const std::string& function, const Defines& defines) {
  std::string options = "-cl-std=CL1.2 -cl-denorms-are-zero -cl-mad-enable -cl-no-signed-zeros";
  options += precision_ == Precision::single ? " -DREAL=float" : " -DREAL=double -DREAL_IS_DOUBLE";
  options += fmt::format(" -DVW={} -DGPU_FORM={}", vector_width(), gpu() ? 1 : 0);
  if (bf16())
    options += fmt::format(" -DMATRIX_UNITS={} -DPRODUCTS={}", static_cast<int>(device_.matrix_units()),
                           device_.math() == Math::bf16 ? 1 : 3);
  // Imitated tiles are for tests, whose time is that of the compiler.
  if (bf16() && device_.matrix_units() == MatrixUnits::imitated) options += " -cl-opt-disable";
  for (const auto& [name, value] : defines)
    options += std::visit([&, &key = name](const auto& v) { return fmt::format(" -D{}={}", key, v); }, value);
  return Call(*this, device_.kernel(file, function, options), function);
}

void Launch::copy(const Tensor& from, const Tensor& to) {
  Command command;
  command.name = "copy";
  command.source = from.memory;
  command.target = to.memory;
  command.bytes = static_cast<std::size_t>(from.elements()) * element_bytes(from.type.dtype, precision_);
  commands_.push_back(std::move(command));
}

void Launch::zero(const Tensor& tensor) {
  const std::int64_t bytes =
      tensor.elements() * static_cast<std::int64_t>(element_bytes(tensor.type.dtype, precision_));
  kernel("zero.cl", "zero")
      .args(tensor, bytes)
      .run({static_cast<std::size_t>((bytes + 63) / 64), 1, 1}, {64, 1, 1});
}

Launch::Call::Call(Launch& launch, Kernel kernel, std::string name)
    : launch_(launch), kernel_(std::move(kernel)), name_(std::move(name)) {}

void Launch::Call::set(std::size_t bytes, const void* data) {
  const cl_int code = clSetKernelArg(kernel_.get(), next_, bytes, data);
  if (code != CL_SUCCESS)
    fail("OpenCL: argument {} of kernel {} is refused with code {}", next_, name_, code);
  ++next_;
}

void Launch::Call::add(const Tensor& tensor) { set(sizeof(cl_mem), &tensor.memory); }

void Launch::Call::add(int number) {
  const cl_int value = number;
  set(sizeof(value), &value);
}

void Launch::Call::add(std::int64_t number) {
  if (number > INT32_MAX || number < INT32_MIN) fail("[{}] {} does not fit into 32 bits", name_, number);
  add(static_cast<int>(number));
}

void Launch::Call::add(double number) {
  if (launch_.precision_ == Precision::double_) return set(sizeof(number), &number);
  const cl_float value = static_cast<cl_float>(number);
  set(sizeof(value), &value);
}

void Launch::Call::run(std::array<std::size_t, 3> items, std::array<std::size_t, 3> local) {
  Command command;
  command.name = name_;
  command.kernel = std::move(kernel_);
  command.local = local;
  for (int axis = 0; axis < 3; ++axis)
    command.global[axis] = (items[axis] + local[axis] - 1) / local[axis] * local[axis];
  launch_.commands_.push_back(std::move(command));
}

}  // namespace vivant
