#include "bench/ops/limits.hpp"

#include "bench/ops/measure.hpp"

namespace vivant::bench {
namespace {

constexpr std::size_t launches_per_batch = 1000;

bool is_gpu(const Device& device) { return device.device_class() == DeviceClass::gpu; }
std::size_t vector_width(const Device& device) { return is_gpu(device) ? 4 : 16; }
std::size_t group_size(const Device& device) { return is_gpu(device) ? 64 : 1; }
/// Vectors that a work-item of triad and read_sum takes: the macro BLOCK.
std::size_t block_vectors(const Device& device) { return is_gpu(device) ? 8 : 1024; }
std::size_t block_bytes(const Device& device) {
  return block_vectors(device) * vector_width(device) * sizeof(float);
}

Tensor tensor_in(const Buffer& buffer) { return {{}, buffer.get()}; }

/// `function` of kernels/limits.cl over `items` work-items, built and called as the ops' kernels are.
template <typename... Args>
Command prepare(Device& device, const std::string& function, std::size_t items, const Args&... args) {
  std::vector<Command> commands;
  Launch launch(device, Precision::single, commands);
  launch
      .kernel("limits.cl", function,
              {{"CHAINS", static_cast<std::int64_t>(fma_chain_count)},
               {"BLOCK", static_cast<std::int64_t>(block_vectors(device))}})
      .args(args...)
      .run({items, 1, 1}, {std::min(items, group_size(device)), 1, 1});
  return std::move(commands.front());
}

void enqueue(Device& device, const Command& command) {
  device.launch(command.kernel, command.name, command.global, command.local);
}

double fastest_seconds(Device& device, const Command& command, bool quick, std::size_t times = 1) {
  const auto work = [&] {
    for (std::size_t i = 0; i < times; ++i) enqueue(device, command);
  };
  return measure(device, "limits/" + command.name, work, quick).fastest_seconds;
}

double fma_rate(Device& device, bool quick) {
  const std::size_t items =
      static_cast<std::size_t>(device.info().compute_units) * (is_gpu(device) ? 2048 : 8);
  const int steps = is_gpu(device) ? 1 << 12 : 1 << 14;
  const std::size_t lanes = items * vector_width(device);
  const Buffer y = device.allocate(lanes * sizeof(float));
  const double flops = 2.0 * static_cast<double>(lanes * fma_chain_count) * steps;
  return flops / fastest_seconds(device, fma_chains(device, y, items, 0.5, 0.25, steps), quick);
}

double matrix_rate(Device& device, bool quick) {
  const auto items = static_cast<std::size_t>(device.info().compute_units);
  const int steps = device.matrix_units() == MatrixUnits::imitated ? 1 : 1 << 9;
  const Buffer y = device.allocate(items * sizeof(float));
  const double flops = 2.0 * 32 * 64 * 128 * steps * static_cast<double>(items);
  return flops / fastest_seconds(device, matrix_products(device, y, items, steps), quick);
}

void measure_memory(Device& device, bool quick, Limits& limits) {
  const std::uint64_t wanted = (quick ? 64ull : 256ull) << 20;
  const std::uint64_t allowed =
      std::min<std::uint64_t>(device.info().largest_buffer_bytes, device.info().memory_bytes / 8);
  const std::size_t granule = granule_bytes(device), bytes = std::min(wanted, allowed) / granule * granule;
  const Buffer a = device.allocate(bytes), b = device.allocate(bytes), y = device.allocate(bytes);
  const Buffer partial = device.allocate(partial_bytes(device, a));
  for (const Buffer* buffer : {&a, &b, &y}) device.fill(*buffer, 0);
  const double size = static_cast<double>(bytes);
  limits.read_bandwidth = size / fastest_seconds(device, read_sum(device, a, partial), quick);
  limits.triad_bandwidth = 3 * size / fastest_seconds(device, triad(device, a, b, y, 3), quick);
}

}  // namespace

Command fma_chains(Device& device, const Buffer& y, std::size_t items, double multiplier, double addend,
                   int steps) {
  return prepare(device, "fma_chains", items, tensor_in(y), multiplier, addend, steps);
}

Command matrix_products(Device& device, const Buffer& y, std::size_t items, int steps) {
  return prepare(device, "matrix_products", items, tensor_in(y), steps);
}

Command triad(Device& device, const Buffer& a, const Buffer& b, const Buffer& y, double s) {
  return prepare(device, "triad", y.bytes() / block_bytes(device), tensor_in(a), tensor_in(b), tensor_in(y),
                 s);
}

Command read_sum(Device& device, const Buffer& x, const Buffer& partial) {
  return prepare(device, "read_sum", x.bytes() / block_bytes(device), tensor_in(x), tensor_in(partial));
}

Command touch(Device& device, const Buffer& y) { return prepare(device, "touch", 1, tensor_in(y)); }

std::size_t granule_bytes(const Device& device) { return block_bytes(device) * group_size(device); }
std::size_t partial_bytes(const Device& device, const Buffer& x) { return x.bytes() / block_vectors(device); }

Limits measure_limits(Device& device, bool quick) {
  Limits limits;
  limits.flops = fma_rate(device, quick);
  limits.matrix_units = name_of(device.matrix_units());
  if (device.math() != Math::fp32) {
    limits.matrix_flops = matrix_rate(device, quick);
    limits.matrix_units = fmt::format("{} in {}", limits.matrix_units, name_of(device.math()));
  }
  measure_memory(device, quick, limits);
  limits.launch_seconds = launch_seconds(device, quick);
  const Buffer one = device.allocate(sizeof(float));
  limits.launch_and_finish_seconds = fastest_seconds(device, touch(device, one), quick);
  return limits;
}

double launch_seconds(Device& device, bool quick) {
  const Buffer one = device.allocate(sizeof(float));
  return fastest_seconds(device, touch(device, one), quick, launches_per_batch) / launches_per_batch;
}

std::string describe(const Limits& limits) {
  return fmt::format(
      "fp32 FMA {:.1f} GF/s; matrix units: {}{}; memory: read {:.1f} GB/s, triad {:.1f} GB/s; "
      "launch {:.2f} us among many, {:.2f} us with a finish",
      limits.flops * 1e-9, limits.matrix_units,
      limits.matrix_flops > 0 ? fmt::format(", {:.1f} GF/s", limits.matrix_flops * 1e-9) : "",
      limits.read_bandwidth * 1e-9, limits.triad_bandwidth * 1e-9, limits.launch_seconds * 1e6,
      limits.launch_and_finish_seconds * 1e6);
}

nlohmann::json to_json(const Limits& limits) {
  return {{"fma_gflops", limits.flops * 1e-9},
          {"matrix_units", limits.matrix_units},
          {"matrix_gflops", limits.matrix_flops * 1e-9},
          {"read_gigabytes_per_second", limits.read_bandwidth * 1e-9},
          {"triad_gigabytes_per_second", limits.triad_bandwidth * 1e-9},
          {"launch_seconds", limits.launch_seconds},
          {"launch_and_finish_seconds", limits.launch_and_finish_seconds}};
}

}  // namespace vivant::bench
