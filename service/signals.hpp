// SIGINT and SIGTERM as a question to ask, on a thread of its own.
#pragma once

#include <signal.h>

#include <atomic>
#include <thread>

namespace freeflex::service {

/// Blocks the two signals for the calling thread and all that it starts, and ignores SIGPIPE. The first
/// signal sets a flag; while is_interruptible, and on the second, it ends the process at once: nothing that
/// needs an orderly end exists then (the ingress dies with its daemon).
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  /// The signal that came, or 0.
  int received() const { return received_.load(std::memory_order_acquire); }
  /// From here on the first signal only sets the flag.
  void end_start_up() { is_starting_.store(false, std::memory_order_release); }

 private:
  void watch();

  sigset_t signals_{};
  std::atomic<int> received_{0};
  std::atomic<bool> is_starting_{true};
  std::atomic<bool> is_ending_{false};
  std::thread thread_;
};

}  // namespace freeflex::service
