#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "vivant/io/tensor_file.hpp"

namespace vivant::peers {

/// A prepared workload of another library.
struct Peer {
  std::function<void()> run;  ///< once, and waits
  std::function<TensorFile()> results;
};
using LoadPeer = std::function<Peer(const nlohmann::json& request, const TensorFile& inputs)>;

/// Answers the commands load, run and results of protocol.py until standard input ends.
void serve(const LoadPeer& load);

}  // namespace vivant::peers
