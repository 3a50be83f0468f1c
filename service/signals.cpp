#include "service/signals.hpp"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <string_view>

#include "service/clock.hpp"

namespace freeflex::service {

namespace {

// the handler may use these variables, because they are lock-free and never destroyed
std::atomic<int> received_signal{0};
std::atomic<std::int64_t> received_ns{0};
std::atomic<bool> is_starting{true};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<std::int64_t>::is_always_lock_free);

/// Runs on any thread at any moment, so it makes only async-signal-safe calls.
extern "C" void on_signal(int number) {
  const int error = errno;
  if (is_starting.load()) {
    static constexpr std::string_view kText = "freeflexd: stopped by a signal before the first tick\n";
    // writing to a full pipe would block for ever
    pollfd log{STDERR_FILENO, POLLOUT, 0};
    const bool takes_text = poll(&log, 1, 0) == 1 && (log.revents & POLLOUT) != 0;
    if (takes_text && write(STDERR_FILENO, kText.data(), kText.size()) < 0) {
      // nothing can be done if the write fails
    }
    _exit(0);
  }
  const std::int64_t now_ns = MonotonicClock{}.now_ns();
  std::int64_t never = 0;
  if (received_ns.compare_exchange_strong(never, now_ns)) {
    received_signal.store(number);
  } else if (now_ns - received_ns.load() >= SignalWatch::kPatience) {
    _exit(1);
  }
  errno = error;
}

void handle(int number) {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigaction(number, &action, nullptr);
}

}  // namespace

void ignore_signals_of_writing() {
  for (const int number : {SIGPIPE, SIGXFSZ, SIGTTOU}) signal(number, SIG_IGN);
}

SignalWatch::SignalWatch() {
  handle(SIGINT);
  handle(SIGTERM);
  struct sigaction hang_up {};
  sigaction(SIGHUP, nullptr, &hang_up);
  if (hang_up.sa_handler != SIG_IGN) handle(SIGHUP);
  // a parent process may have blocked these signals, so they are unblocked here; threads that start later
  // inherit this mask
  sigset_t taken;
  sigemptyset(&taken);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&taken, number);
  pthread_sigmask(SIG_UNBLOCK, &taken, nullptr);
}

int SignalWatch::received() const { return received_signal.load(); }
void SignalWatch::end_start_up() { is_starting.store(false); }

}  // namespace freeflex::service
