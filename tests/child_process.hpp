#pragma once
#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "io_helpers.hpp"
#include "vivant/io/atomic_file.hpp"

namespace vivant {

/// What a command printed and its exit code.
struct Finished {
  int exit_code = 0;
  std::string out, err;
};

/// Runs a shell command to its end.
inline Finished run_command(const std::string& command) {
  const TemporaryFolder folder;
  const std::string out = folder / "out", err = folder / "err";
  const int status = std::system(("(" + command + ") >" + out + " 2>" + err).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_whole_file(out),
          read_whole_file(err)};
}

/// Runs `vivant` with these arguments, after `environment` ("NAME=value NAME=value").
inline Finished run_vivant(const std::string& arguments, const std::string& environment = "") {
  return run_command(environment + " " + VIVANT_PROGRAM + " " + arguments);
}

}  // namespace vivant
