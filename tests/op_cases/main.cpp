// Runs the op cases of one file (or all) through every check, on both device classes:
//   op_cases [FILE_STEM]             values, gradients, guard bands, bitwise repeat
//   op_cases --memory FILE_STEM      only runs the small variations, each value in a buffer of its own: for
//   Oclgrind op_cases --bits [FILE_STEM]      prints a hash of every result: equal with one thread and with
//   many
#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <memory>

#include "cases/case_runner.hpp"
#include "vivant/ops/registry.hpp"

using namespace vivant;
using namespace vivant::cases;

namespace {

constexpr const char* device_classes[] = {"cpu", "gpu"};

enum class Devices { shared, fresh };

template <typename Visit>
int for_each_variation(const std::string& file, Visit visit, Devices devices = Devices::shared) {
  int count = 0;
  for (const char* device_class : device_classes) {
    std::unique_ptr<Device> device;
    for (const OpCase& op_case : all_cases()) {
      if (!file.empty() && op_case.file != file) continue;
      for (const Variation& variation : op_case.variations) {
        if (!device || devices == Devices::fresh)
          device = std::make_unique<Device>(DeviceOptions{.device = "", .device_class = device_class});
        visit(*device, device_class, op_case, variation);
        ++count;
      }
    }
  }
  if (count == 0) fail("no op case file is called '{}'", file);
  return count;
}

int check_all(const std::string& file) {
  int wrong = 0;
  const auto check = [&](Device& device, const char* device_class, const OpCase& op_case,
                         const Variation& variation) {
    for (auto one : {check_values, check_gradients, check_guards, check_repeat})
      for (const std::string& finding : one(device, op_case, variation)) {
        fmt::print("WRONG ({} form) {}\n", device_class, finding);
        ++wrong;
      }
  };
  const int count = for_each_variation(file, check);
  fmt::print("{} variations checked, {} findings\n", count, wrong);
  return wrong == 0 ? 0 : 1;
}

/// A device for each variation: Oclgrind 21.10 keeps the size of a freed buffer when its place is used again
/// within a context, and takes what lies behind for uninitialised.
void run_for_memory_checker(const std::string& file) {
  ExecutorOptions options;
  options.separate_buffers = true;
  const auto run_once = [&](Device& device, const char*, const OpCase& op_case, const Variation& variation) {
    CaseRun run(device, op_case, variation, true, options);
    run.run();
    run.bytes();
  };
  for_each_variation(file, run_once, Devices::fresh);
}

void print_bits(const std::string& file) {
  for_each_variation(
      file, [&](Device& device, const char* device_class, const OpCase& op_case, const Variation& variation) {
        CaseRun run(device, op_case, variation, true);
        run.run();
        std::uint64_t hash = 14695981039346656037ull;
        for (std::uint8_t byte : run.bytes()) hash = (hash ^ byte) * 1099511628211ull;
        fmt::print("{:016x} {} {}\n", hash, device_class, describe(op_case, variation));
      });
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string first = argc > 1 ? argv[1] : "", second = argc > 2 ? argv[2] : "";
  if (first == "--memory") {
    run_for_memory_checker(second);
  } else if (first == "--bits") {
    print_bits(second);
  } else {
    return check_all(first);
  }
  return 0;
} catch (const Error& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
