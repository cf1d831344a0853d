// Runs the op cases of one file (or all) through every check, on both device classes:
//   op_cases [FILE_STEM]             values, gradients, guard bands, bitwise repeat
//   op_cases --memory FILE_STEM      only runs the small variations, each value in a buffer of its own:
//                                    for Oclgrind
//   op_cases --bits [FILE_STEM]      prints a hash of every result: equal with one thread and with many
//   op_cases --math MODE FILE_STEM   values and gradients in bf16x3 or bf16
#include <fmt/format.h>

#include <cmath>
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
int for_each_variation(const std::string& file, Visit visit, Devices devices = Devices::shared,
                       const std::string& math = "fp32") {
  int count = 0;
  for (const char* device_class : device_classes) {
    if (math != "fp32" && std::string(device_class) == "gpu") continue;  // GPUs compute in fp32
    std::unique_ptr<Device> device;
    for (const OpCase& op_case : all_cases()) {
      if (!file.empty() && op_case.file != file) continue;
      std::vector<Variation> variations = op_case.variations;
      if (math != "fp32")
        variations.insert(variations.end(), op_case.for_matrix_units.begin(), op_case.for_matrix_units.end());
      for (const Variation& variation : variations) {
        if (!device || devices == Devices::fresh)
          device = std::make_unique<Device>(
              DeviceOptions{.device = "", .device_class = device_class, .profile = false, .math = math});
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

/// Values and gradients by matrix units, against the reference and the gradients in double.
int check_math(const std::string& math, const std::string& file) {
  const Device device(DeviceOptions{.device = "", .device_class = "cpu", .profile = false, .math = math});
  if (device.math() != math_from(math)) {
    fmt::print("skipped: {} does not run in {} here (matrix units: {})\n", file, math,
               name_of(device.matrix_units()));
    return 0;
  }
  // Over all results; a single one of a few elements may be three times worse.
  const double tolerance = math == "bf16" ? 1e-2 : 1e-5, tolerance_of_one = 3 * tolerance;
  int wrong = 0;
  ErrorSum all;
  const auto check = [&](Device& on, const char*, const OpCase& op_case, const Variation& variation) {
    Findings findings = check_rms_errors(on, op_case, variation, tolerance_of_one, all);
    for (auto one : {check_guards, check_repeat})
      for (const std::string& finding : one(on, op_case, variation)) findings.push_back(finding);
    for (const std::string& finding : findings) fmt::print("WRONG ({}) {}\n", math, finding);
    wrong += static_cast<int>(findings.size());
  };
  const int count = for_each_variation(file, check, Devices::shared, math);
  const double error = std::sqrt(all.squares / all.elements);
  fmt::print("{} variations checked on {} units in {}, {} findings, relative rms error {:.2g}\n", count,
             name_of(device.matrix_units()), math, wrong, error);
  const bool rounded = math != "bf16" || error > 1e-4;
  if (!rounded) fmt::print("WRONG: so exact that nothing was rounded to bf16\n");
  return wrong == 0 && error <= tolerance && rounded ? 0 : 1;
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
  if (first == "--math") {
    return check_math(second, argc > 3 ? argv[3] : "");
  } else if (first == "--memory") {
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
