#pragma once
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <vector>

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

/// `vivant` in the background, in a process group of its own; killed when the test ends before it.
class BackgroundVivant {
 public:
  /// `log`: what it prints.
  BackgroundVivant(const std::vector<std::string>& arguments, const std::filesystem::path& log) {
    std::vector<std::string> words = {VIVANT_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    pointers.reserve(words.size() + 1);
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    child_ = fork();
    if (child_ == 0) {
      setpgid(0, 0);
      const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
      dup2(file, STDOUT_FILENO);
      dup2(file, STDERR_FILENO);
      execv(VIVANT_PROGRAM, pointers.data());
      _exit(127);
    }
    setpgid(child_, child_);  // whichever of the two comes first
  }
  BackgroundVivant(const BackgroundVivant&) = delete;
  BackgroundVivant& operator=(const BackgroundVivant&) = delete;
  ~BackgroundVivant() { finish(SIGKILL); }

  bool runs() {
    if (child_ > 0 && waitpid(child_, &status_, WNOHANG) == child_) child_ = 0;
    return child_ > 0;
  }
  /// Sends a signal (0: none; SIGINT to the whole group, as a terminal does) and waits for the end: the exit
  /// code, or 128 + the signal that ended it.
  int finish(int signal = 0) {
    if (child_ > 0) {
      if (signal != 0) kill(signal == SIGINT ? -child_ : child_, signal);
      waitpid(child_, &status_, 0);
      child_ = 0;
    }
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }

 private:
  pid_t child_ = -1;
  int status_ = 0;
};

}  // namespace vivant
