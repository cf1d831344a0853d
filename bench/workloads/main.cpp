// Our side of scripts/compare-peers: one workload at a time, by commands on standard input, one answer line
// each. The programs in bench/peers answer the same commands, but for launches and memory.
//   modes                  -> modes fp32 ...   those that this machine's processor runs
//   load {"workload": NAME, "mode": MODE, sizes...}   -> ready
//   inputs FILE            writes what other programs need to compute the same   -> written
//   run N                  -> seconds S1 ... SN
//   launches               -> launches N S   kernels in one of these runs, and the seconds of one launch here
//   memory                 -> memory ARENA BOUND   bytes: the plan's arena, and the most alive at one time
//   results FILE           writes what the last run computed   -> written
// `workloads --profile` prints the time of every kernel after each command "run".
#include <fmt/ranges.h>

#include <chrono>
#include <iostream>
#include <sstream>

#include "bench/ops/limits.hpp"
#include "vivant/io/safetensors.hpp"
#include "workload.hpp"

namespace vivant::bench {
namespace {

class Server {
 public:
  explicit Server(const DeviceOptions& options) : options_(options) {
    for (const WorkloadTable& part : {op_workloads(), field_workloads(), style_workloads()})
      table_.insert(part.begin(), part.end());
  }

  std::string answer(const std::string& command, const std::string& argument) {
    if (command == "modes") return modes();
    if (command == "load") return load(Sizes::parse(argument));
    if (!workload_) throw UsageError(fmt::format("no workload is loaded for '{}'", command));
    if (command == "run") return run(std::stoi(argument));
    if (command == "launches") return launches();
    if (command == "memory")
      return fmt::format("memory {} {}", workload_->executor().arena_bytes(),
                         workload_->executor().lower_bound_bytes());
    if (command != "inputs" && command != "results")
      throw UsageError(fmt::format("unknown command '{}'", command));
    write_safetensors(argument, command == "inputs" ? workload_->inputs() : workload_->results());
    return "written";
  }

 private:
  DeviceOptions in_mode(const std::string& mode) const {
    DeviceOptions options = options_;
    options.math = mode;
    return options;
  }

  std::string modes() const {
    std::string answer = "modes";
    for (const char* mode : {"fp32", "bf16x3", "bf16"})
      if (name_of(Device(in_mode(mode)).math()) == mode) answer += std::string(" ") + mode;
    return answer;
  }

  std::string load(const Sizes& sizes) {
    const std::string name = sizes.at("workload");
    if (!table_.contains(name)) throw UsageError(fmt::format("there is no workload '{}'", name));
    workload_.reset();
    const std::string mode = sizes.value("mode", "fp32");
    if (!device_ || name_of(device_->math()) != mode) device_ = std::make_unique<Device>(in_mode(mode));
    workload_ = table_.at(name)(*device_, sizes);
    return "ready";
  }

  std::string run(int repetitions) {
    device_->profiler().reset();
    const std::int64_t before = device_->launches();
    std::string seconds = "seconds";
    for (int i = 0; i < repetitions; ++i) {
      const auto start = std::chrono::steady_clock::now();
      workload_->run();
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
      seconds += fmt::format(" {:.9f}", taken.count());
    }
    launches_per_run_ = (device_->launches() - before) / std::max(repetitions, 1);
    if (device_->profiler().enabled()) std::cerr << device_->profiler().table();
    return seconds;
  }

  std::string launches() {
    if (launch_seconds_ == 0) launch_seconds_ = launch_seconds(*device_, false);
    return fmt::format("launches {} {:.9f}", launches_per_run_, launch_seconds_);
  }

  DeviceOptions options_;
  std::unique_ptr<Device> device_;
  WorkloadTable table_;
  std::unique_ptr<Workload> workload_;
  std::int64_t launches_per_run_ = 0;
  double launch_seconds_ = 0;
};

}  // namespace
}  // namespace vivant::bench

int main(int argc, char** argv) try {
  vivant::DeviceOptions options;
  options.profile = argc > 1 && std::string(argv[1]) == "--profile";
  vivant::bench::Server server(options);
  for (std::string line; std::getline(std::cin, line);) {
    const std::size_t space = std::min(line.find(' '), line.size());
    try {
      std::cout << server.answer(line.substr(0, space), line.substr(std::min(space + 1, line.size())));
    } catch (const std::exception& error) {
      std::cout << "error " << error.what();
    }
    std::cout << std::endl;
  }
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
