#include "vivant/jobs/interrupt.hpp"

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <string_view>

namespace vivant {
namespace {

std::atomic<bool> flag{false};
static_assert(std::atomic<bool>::is_always_lock_free, "the handler may only touch lock-free state");

struct sigaction before[2];
int guards = 0;  // that live: jobs within jobs share the first one's handlers and flag
constexpr int signals[2] = {SIGINT, SIGTERM};

void say(std::string_view text) {
  if (write(STDERR_FILENO, text.data(), text.size()) < 0) return;  // nothing can be done about it
}

void on_signal(int) {
  if (flag.exchange(true)) {
    say("\nvivant: stopped at once, without saving\n");
    _exit(130);
  }
  say("\nvivant: stopping after this step (once more: at once, without saving)\n");
}

}  // namespace

InterruptGuard::InterruptGuard() {
  if (guards++ > 0) return;
  flag = false;
  struct sigaction action = {};
  action.sa_handler = on_signal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  for (int i = 0; i < 2; ++i) sigaction(signals[i], &action, &before[i]);
}

InterruptGuard::~InterruptGuard() {
  if (--guards > 0) return;
  flag = false;
  for (int i = 0; i < 2; ++i) sigaction(signals[i], &before[i], nullptr);
}

bool interrupted() { return flag; }

}  // namespace vivant
