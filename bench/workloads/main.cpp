// Our side of scripts/compare-peers: one workload at a time, by commands on standard input, one answer line
// each. The programs in bench/peers answer the same commands.
//   modes                  -> modes fp32
//   load {"workload": NAME, "mode": MODE, sizes...}   -> ready
//   inputs FILE            writes what other programs need to compute the same   -> written
//   run N                  -> seconds S1 ... SN
//   results FILE           writes what the last run computed   -> written
// `workloads --profile` prints the time of every kernel after each command "run".
#include <fmt/ranges.h>

#include <chrono>
#include <iostream>
#include <sstream>

#include "vivant/io/safetensors.hpp"
#include "workload.hpp"

namespace vivant::bench {
namespace {

class Server {
 public:
  explicit Server(const DeviceOptions& options) : device_(options) {
    for (const WorkloadTable& part : {op_workloads(), field_workloads(), style_workloads()})
      table_.insert(part.begin(), part.end());
  }

  std::string answer(const std::string& command, const std::string& argument) {
    if (command == "modes") return "modes fp32";
    if (command == "load") return load(Sizes::parse(argument));
    if (!workload_) throw UsageError(fmt::format("no workload is loaded for '{}'", command));
    if (command == "run") return run(std::stoi(argument));
    if (command != "inputs" && command != "results")
      throw UsageError(fmt::format("unknown command '{}'", command));
    write_safetensors(argument, command == "inputs" ? workload_->inputs() : workload_->results());
    return "written";
  }

 private:
  std::string load(const Sizes& sizes) {
    const std::string name = sizes.at("workload");
    if (!table_.contains(name)) throw UsageError(fmt::format("there is no workload '{}'", name));
    workload_.reset();
    workload_ = table_.at(name)(device_, sizes);
    return "ready";
  }

  std::string run(int repetitions) {
    device_.profiler().reset();
    std::string seconds = "seconds";
    for (int i = 0; i < repetitions; ++i) {
      const auto start = std::chrono::steady_clock::now();
      workload_->run();
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
      seconds += fmt::format(" {:.9f}", taken.count());
    }
    if (device_.profiler().enabled()) std::cerr << device_.profiler().table();
    return seconds;
  }

  Device device_;
  WorkloadTable table_;
  std::unique_ptr<Workload> workload_;
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
