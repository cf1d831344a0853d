#include "peer_server.hpp"

#include <fmt/format.h>

#include <chrono>
#include <iostream>

#include "vivant/io/safetensors.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant::peers {
namespace {

std::string seconds_of(const std::function<void()>& run, int repetitions) {
  std::string line = "seconds";
  for (int i = 0; i < repetitions; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run();
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    line += fmt::format(" {:.9f}", taken.count());
  }
  return line;
}

}  // namespace

void serve(const LoadPeer& load) {
  Peer peer;
  const auto answer = [&](const std::string& command, const std::string& argument) -> std::string {
    if (command == "load") {
      const nlohmann::json request = nlohmann::json::parse(argument);
      peer = load(request, read_safetensors(request.at("inputs").get<std::string>()));
      return "ready";
    }
    if (command == "run") return seconds_of(peer.run, std::stoi(argument));
    if (command != "results") fail("unknown command '{}'", command);
    write_safetensors(argument, peer.results());
    return "written";
  };
  for (std::string line; std::getline(std::cin, line);) {
    const std::size_t space = std::min(line.find(' '), line.size());
    try {
      std::cout << answer(line.substr(0, space), line.substr(std::min(space + 1, line.size())));
    } catch (const std::exception& error) {
      std::cout << "error " << error.what();
    }
    std::cout << std::endl;
  }
}

}  // namespace vivant::peers
