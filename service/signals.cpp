#include "service/signals.hpp"

#include <pthread.h>
#include <unistd.h>

#include <string_view>

namespace freeflex::service {

SignalWatch::SignalWatch() {
  signal(SIGPIPE, SIG_IGN);
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  thread_ = std::thread([this] { watch(); });
}

SignalWatch::~SignalWatch() {
  is_ending_.store(true, std::memory_order_release);
  pthread_kill(thread_.native_handle(), SIGTERM);
  thread_.join();
}

void SignalWatch::watch() {
  for (;;) {
    int number = 0;
    if (sigwait(&signals_, &number) != 0) continue;
    if (is_ending_.load(std::memory_order_acquire)) return;
    if (is_starting_.load(std::memory_order_acquire)) {
      static constexpr std::string_view kText = "freeflexd: stopped by a signal before the first tick\n";
      [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kText.data(), kText.size());
      _exit(0);
    }
    if (received_.exchange(number, std::memory_order_acq_rel) != 0) _exit(1);
  }
}

}  // namespace freeflex::service
