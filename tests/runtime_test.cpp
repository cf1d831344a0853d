// Devices, buffers, kernel sources and the cache of compiled programs.
#include "environment.hpp"
#include "io_helpers.hpp"
#include "runtime/program_cache.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/device.hpp"

using namespace vivant;

namespace {

/// A kernel folder with probe.cl, which writes `value` + OFFSET, and a cache folder, both for one test.
struct Workshop {
  Workshop() { write_probe("1.0f"); }
  void write_probe(const std::string& value) {
    write_file(kernels / "shared.clh", "#define SHARED " + value + "\n");
    write_file(
        kernels / "probe.cl",
        "#include \"shared.clh\"\n#include \"shared.clh\"\n#ifndef OFFSET\n#define OFFSET 0.0f\n#endif\n"
        "__kernel void probe(__global float* y) { y[get_global_id(0)] = SHARED + OFFSET; }\n");
  }
  /// What the kernel writes.
  static float run(Device& device, const std::string& options = "") {
    const Kernel kernel = device.kernel("probe.cl", "probe", options);
    const Buffer y = device.allocate(sizeof(float));
    const cl_mem memory = y.get();
    check(clSetKernelArg(kernel.get(), 0, sizeof(cl_mem), &memory), "clSetKernelArg");
    const std::size_t one = 1;
    check(clEnqueueNDRangeKernel(device.queue(), kernel.get(), 1, nullptr, &one, &one, 0, nullptr, nullptr),
          "clEnqueueNDRangeKernel");
    float result = -1;
    device.read(y, &result, sizeof(result));
    return result;
  }
  std::vector<std::filesystem::path> cached() const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(cache.path())) files.push_back(entry.path());
    return files;
  }

  TemporaryFolder kernels, cache;
  ScopedVariable kernels_variable{"VIVANT_KERNELS", kernels.path().string()};
  ScopedVariable cache_variable{"VIVANT_CACHE", cache.path().string()};
};

DeviceOptions named(const std::string& device, const std::string& device_class = "") {
  return {device, device_class, false, ""};
}

/// A fresh device runs the probe; checks the result and whether the program was compiled or came from the
/// disk.
void check_probe(float expected, int built, int loaded, const std::string& options = "") {
  Device device;
  CHECK(Workshop::run(device, options) == expected);
  CHECK(device.programs_built() == built);
  CHECK(device.programs_loaded() == loaded);
}

}  // namespace

TEST_CASE("runtime: programs are compiled once, then come from memory, then from the disk") {
  const Workshop workshop;
  {
    Device device;
    CHECK(Workshop::run(device) == 1);
    CHECK(Workshop::run(device) == 1);
    CHECK(device.programs_built() == 1);
    CHECK(device.programs_loaded() == 0);
  }
  REQUIRE(workshop.cached().size() == 1);
  CHECK(workshop.cached().front().extension() == ".bin");  // no temporary file is left
  check_probe(1, 0, 1);
}

TEST_CASE("runtime: options and the sources, included ones too, are part of a cached program's key") {
  Workshop workshop;
  check_probe(1, 1, 0);
  check_probe(3, 1, 0, "-DOFFSET=2.0f");
  workshop.write_probe("5.0f");
  check_probe(5, 1, 0);
  CHECK(workshop.cached().size() == 3);
  workshop.write_probe("1.0f");
  check_probe(1, 0, 1);
  check_probe(3, 0, 1, "-DOFFSET=2.0f");
}

TEST_CASE("runtime: a corrupt cache entry is rebuilt") {
  const Workshop workshop;
  check_probe(1, 1, 0);
  const std::filesystem::path entry = workshop.cached().front();
  const std::string whole = read_whole_file(entry);
  std::vector<std::string> corrupt = {"", whole.substr(0, 5), whole.substr(0, whole.size() / 2),
                                      "text" + whole};
  for (std::size_t place : {std::size_t{0}, std::size_t{9}, whole.size() / 2, whole.size() - 1}) {
    corrupt.push_back(whole);
    corrupt.back()[place] = static_cast<char>(corrupt.back()[place] ^ 4);
  }
  // Well-formed for the cache, but nothing that the driver accepts.
  const std::string nonsense = "no program";
  ProgramCache::store("another key", {nonsense.begin(), nonsense.end()});
  for (const auto& file : workshop.cached())
    if (file != entry) {
      corrupt.push_back(read_whole_file(file));
      std::filesystem::remove(file);
    }
  REQUIRE(corrupt.size() == 9);
  for (const std::string& bytes : corrupt) {
    write_file(entry, bytes);
    check_probe(1, 1, 0);
    check_probe(1, 0, 1);
    CHECK(workshop.cached().size() == 1);
  }
}

TEST_CASE("runtime: an empty VIVANT_CACHE or XDG_CACHE_HOME counts as not set") {
  const Workshop workshop;
  const ScopedVariable cache("VIVANT_CACHE", ""), xdg("XDG_CACHE_HOME", "");
  const ScopedVariable home("HOME", (workshop.cache / "home").string());
  check_probe(1, 1, 0);
  CHECK(std::filesystem::exists(workshop.cache / "home/.cache/vivant"));
}

TEST_CASE("runtime: a cache that cannot be written only costs time") {
  const Workshop workshop;
  const TemporaryFolder folder;
  write_file(folder / "file", "");
  const ScopedVariable variable("VIVANT_CACHE", (folder / "file/cache").string());
  check_probe(1, 1, 0);
  check_probe(1, 1, 0);
}

TEST_CASE("runtime: VIVANT_KERNELS replaces the embedded kernels, and errors name the file") {
  const Workshop workshop;
  Device device;
  CHECK(contains(error_of([&] { device.kernel("linear.cl", "linear_forward", ""); }),
                 "no kernel file linear.cl in the folder VIVANT_KERNELS="));
  write_file(workshop.kernels / "broken.cl", "__kernel void broken( { }\n");
  std::string message;
  try {
    device.kernel("broken.cl", "broken", "-DX=3");
  } catch (const Error& error) {
    message = error.what();
  }
  CHECK(contains(message, "kernels/broken.cl does not compile"));
  CHECK(contains(message, "-DX=3"));
  CHECK(contains(message, "error:"));  // the build log
  CHECK(contains(error_of([&] { device.kernel("probe.cl", "nothing", ""); }), "nothing in probe.cl"));
  unsetenv("VIVANT_KERNELS");
  CHECK(contains(error_of([&] { device.kernel("no.cl", "no", ""); }), "no.cl is embedded"));
}

TEST_CASE("runtime: devices are chosen by number, by name, by variable and else by kind") {
  const std::vector<DeviceInfo> infos = list_devices();
  REQUIRE_FALSE(infos.empty());
  CHECK(Device(named("0")).info().index == 0);
  CHECK(Device(named(infos[0].name)).info().index == 0);
  CHECK(Device(named(infos[0].platform.substr(0, 8))).info().index == 0);
  CHECK_THROWS_AS(Device(named("1000")), UsageError);
  {
    const ScopedVariable variable("VIVANT_DEVICE", "no such device");
    CHECK(contains(error_of([] { Device device; }), "'no such device': `vivant devices`"));
    CHECK(Device(named("0")).info().index == 0);
  }
  CHECK(Device(named("", "gpu")).device_class() == DeviceClass::gpu);
  CHECK(Device(named("", "cpu")).device_class() == DeviceClass::cpu);
  CHECK_THROWS_AS(Device(named("", "tpu")), UsageError);
}

TEST_CASE("runtime: buffers, views and their limits") {
  Device device;
  const Buffer whole = device.allocate(4 * device.alignment());
  device.fill(whole, 0);
  const Buffer view = device.view(whole, device.alignment(), device.alignment());
  const std::vector<std::uint8_t> sevens(device.alignment(), 7);
  device.write(view, sevens.data(), sevens.size());
  std::vector<std::uint8_t> all(whole.bytes());
  device.read(whole, all.data(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) CHECK(all[i] == (i / device.alignment() == 1 ? 7 : 0));
  std::uint8_t last = 1;
  device.read(whole, &last, 1, 2 * device.alignment() - 1);
  CHECK(last == 7);
  CHECK(device.allocate(0).bytes() == 1);
  CHECK(contains(error_of([&] { device.allocate(device.info().largest_buffer_bytes + 1); }),
                 "MiB was asked for"));
  CHECK(contains(error_of([&] { check(-5, "clSomething"); }), "clSomething failed with code -5 ("));
}

TEST_CASE("runtime: kernels are timed by name when asked for") {
  const Workshop workshop;
  DeviceOptions options;
  options.profile = true;
  Device device(options);
  const Kernel kernel = device.kernel("probe.cl", "probe", "");
  const Buffer y = device.allocate(64 * sizeof(float));
  const cl_mem memory = y.get();
  check(clSetKernelArg(kernel.get(), 0, sizeof(cl_mem), &memory), "clSetKernelArg");
  const std::size_t items = 64;
  for (int i = 0; i < 3; ++i) {
    cl_event event = nullptr;
    check(
        clEnqueueNDRangeKernel(device.queue(), kernel.get(), 1, nullptr, &items, nullptr, 0, nullptr, &event),
        "clEnqueueNDRangeKernel");
    device.profiler().record("probe", event);
  }
  CHECK(device.profiler().totals().at("probe").launches == 3);
  CHECK(device.profiler().totals().at("probe").seconds > 0);
  CHECK(contains(device.profiler().table(), "probe"));
  device.profiler().reset();
  CHECK(device.profiler().totals().empty());
}
