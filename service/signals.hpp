// Turns SIGINT, SIGTERM and SIGHUP into a flag to poll, and ignores the signals that a write can raise.
#pragma once

namespace freeflex::service {

/// Ensures that a failed write only returns an error. Without this, a pipe that has no reader (SIGPIPE) or a
/// log that reaches the file size limit (SIGXFSZ, `ulimit -f`) would kill the process, and a terminal that
/// does not let background jobs write would stop it (SIGTTOU, `stty tostop`).
void ignore_signals_of_writing();

/// Handles the three signals for the whole process, whatever mask and dispositions the process inherited. A
/// shell starts background jobs with SIGINT ignored, but `kill -INT` should still end a daemon. If SIGHUP was
/// ignored, it stays ignored, as nohup requires. The first signal sets a flag. In two cases the handler ends
/// the process at once: during start-up (exit status 0), and if another signal comes kPatience or more after
/// the first, because the clean end then hangs (exit status 1). Ending at once is safe, because the ingress
/// ends with its daemon. A process has at most one such object.
class SignalWatch {
 public:
  static constexpr long long kPatience = 1'000'000'000;  // [ns] a clean end takes a few milliseconds

  SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  /// Returns the first signal, or 0. Any thread may call this function.
  int received() const;
  /// Marks the end of start-up. After this call the first signal only sets the flag. Any thread may call this
  /// function.
  void end_start_up();
};

}  // namespace freeflex::service
